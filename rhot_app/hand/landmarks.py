"""The errors of image landmarks: 21 joints of a bare hand as a detector reports them, each an observation of its joint.

A landmark is a marker at a joint (`hand.places.LANDMARK_ROLES`) that errs more, and otherwise. Where it lies about the
joint's centre of the kinematic hand changes slowly, in all cameras alike. Beside that, each landmark of each frame errs
by itself, with the tails of centroids. A detector errs in proportion to the hand's size in the image, so both are
lengths at the hand, per axis.

`python benchmarks/landmarks.py` measures them on a recorded hand.
"""

from __future__ import annotations

import math

ANATOMY_SD_M = 3e-3
"""m: standard deviation of a landmark's place about its joint: 2.4 mm on a recorded hand that fits it best."""

LASTING_S = 0.3
"""s: correlation time of that place."""

NOISE_M = 3e-3
"""m: standard deviation of a landmark's own error in a frame, beside what its detector states. Chosen by the frames
from 13 to 66 of a recorded hand with its own bones: of 1.5 to 6 mm it leaves 95 % of the joints nearest to
triangulation, within 7.3 mm (median 3.1). In those from 67 to 119 these are 5.8 and 2.6 mm
(`python benchmarks/landmarks.py`)."""

MEDIAN_M = math.sqrt(2.0 * math.log(2.0) * (ANATOMY_SD_M**2 + NOISE_M**2))
"""m: median distance of a landmark from its joint: a Rayleigh distribution's."""

DISAGREEMENT_M = 1.7 * MEDIAN_M
"""m: median distance of a hand's landmarks from its joints from which its rig or its bones are wrong: 8.5 mm. Chosen
between those of a recorded hand, frame by frame: at most 4.7 mm with its own bones and 6.2 with the shipped ones, and
10.4 or more at 0.58 of the true scale (`python benchmarks/wrong_rigs.py`)."""
