"""What lies under the mouse in the scene, and what is known of it in numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.lens.camera_calibration import CalibrationError
from rhot_app.hand.skeleton import JOINTS
from rhot_app.tracking.state import HandState, Knowledge
from rhot_app.ui.models.hands import each_hand
from rhot_app.ui.models.rows import position_text, short_name
from rhot_app.ui.models.spread import sd_text, total_sd
from rhot_app.ui.models.words import KNOWLEDGE
from rhot_app.ui.scene.hand_mesh import TIPS

Array = NDArray[np.float64]

REACH_PX = 16.0


@dataclass(frozen=True, slots=True)
class Spot:
    """Something with a place: what it is called, how it is known, where (3,) m rig frame, covariance (3, 3) m^2."""

    name: str
    knowledge: Knowledge
    place: Array
    covariance: Array

    def text(self, by_calibration: CalibrationError) -> str:
        """Its tooltip."""
        spread = sd_text(float(total_sd(self.covariance, self.place, by_calibration)))
        unknown = by_calibration.reason or "its uncertainty is not estimated"
        lines = [f"{self.name}: {KNOWLEDGE[self.knowledge].word}",
                 f"{spread} along the worst axis (one sigma)" if spread else unknown,
                 f"x, y, z: {position_text(self.place)}"]
        return "\n".join(lines)


def spots(state: HandState, hands: Sequence[str] = ("",)) -> list[Spot]:
    """Markers first, then the joints that no marker's middle stands for; `hands` are their names, "" for none."""
    found = [Spot(f"marker {short_name(name)}", Knowledge(int(state.marker_knowledge[k])), state.marker_positions[k],
                  state.marker_covariances[k]) for k, name in enumerate(state.marker_ids)]
    for name, hand in zip(hands, each_hand(state), strict=False):  # the other hand is not there with every tracker
        found += [Spot(f"{name} {joint_name(JOINTS[k])}".lstrip(), Knowledge(int(hand.joint_knowledge[k])),
                       hand.joint_positions[k], hand.joint_covariances[k])
                  for k in range(len(JOINTS)) if k not in TIPS]
    return [spot for spot in found if np.isfinite(spot.place).all()]


def joint_name(joint: str) -> str:
    """A joint as people say it: "index_pip" is "index PIP joint"."""
    finger, _, name = joint.partition("_")
    return f"{finger} {name.upper()} joint" if name else f"{finger} joint"


def nearest(pixels: Array, at: tuple[float, float]) -> int | None:
    """Which of `pixels` (N, 2), NaN for none, lies nearest to `at` and within reach."""
    distances = np.linalg.norm(pixels - np.array(at), axis=1)
    distances = np.where(np.isfinite(distances), distances, np.inf)
    best = int(np.argmin(distances)) if len(distances) else 0
    return best if len(distances) and distances[best] <= REACH_PX else None
