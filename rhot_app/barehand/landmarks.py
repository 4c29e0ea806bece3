"""The errors of image landmarks: 21 joints of a bare hand as a detector reports them, each an observation of its joint.

A landmark is a marker at a joint (`hand.places.LANDMARK_ROLES`) that errs more, and otherwise. Its mean place is not
the joint's centre of the kinematic hand, in all cameras alike. Each camera's detector has an error that lasts for a
while. Each frame has an error that is common to all its landmarks, and each landmark an error of its own. A detector
errs in proportion to the hand's size in the image, so all these are lengths at the hand, per axis.

`python benchmarks/landmarks.py` measures them on a recorded hand.
"""

from __future__ import annotations

ANATOMY_SD_M = 3e-3
"""m: standard deviation of a landmark's mean place about its joint."""

LASTING_M = 2e-3
"""m: standard deviation of the error of one camera's detector that lasts."""

LASTING_S = 0.3
"""s: correlation time of that error."""

COMMON_M = 1e-3
"""m: standard deviation of the error that all landmarks of a frame have in common."""

NOISE_M = 1.3e-3
"""m: standard deviation of a landmark's own error in a frame, beside what its detector states."""
