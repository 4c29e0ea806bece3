"""A rig of two hands and a state of both, taken apart for what draws one hand: each as if it were alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.check.camera_calibration import CalibrationAccuracy
from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.skeleton import FINGERS, JOINTS
from rhot_app.project import OTHER_HAND, Rig
from rhot_app.state import HandState, Knowledge
from rhot_app.ui.language import tr
from rhot_app.ui.models.rows import marker_name, position_text, sd_text, total_sd
from rhot_app.ui.models.words import KNOWLEDGE, each_hand
from rhot_app.ui.scene.hand_mesh import TIPS
from rhot_node.markers import MarkerSet

Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class OneHand:
    """A hand of a rig, its `first` or the other one.

    `columns` (m,) say which of the rig's markers are its own: `markers`, with the roles of a hand that is alone.
    """

    anatomy: HandAnatomy
    markers: MarkerSet
    columns: Indices
    first: bool

    def state_of(self, state: HandState) -> HandState:
        """This hand at a state of the whole rig, with its own markers only.

        A tracker that does not follow the other hand may still know where that hand's markers are.
        """
        hand = state if self.first else state.other or _unknown(state)
        own = self.columns
        return replace(hand, marker_ids=self.markers.ids, marker_positions=state.marker_positions[own],
                       marker_covariances=state.marker_covariances[own], marker_knowledge=state.marker_knowledge[own],
                       other=None)


def hands_of(rig: Rig) -> tuple[OneHand, ...]:
    """The rig's hands, its `hand` first. Markers that no hand wears go with that one."""
    others = np.array([(marker.role or "").startswith(OTHER_HAND) for marker in rig.markers.markers])
    found = [_one_hand(rig, rig.hand, ~others, first=True)]
    if rig.other_hand is not None:
        found.append(_one_hand(rig, rig.other_hand, others, first=False))
    return tuple(found)


def _one_hand(rig: Rig, anatomy: HandAnatomy, wears: NDArray[np.bool_], *, first: bool) -> OneHand:
    columns = np.flatnonzero(wears)
    own = (rig.markers.markers[column] for column in columns)
    alone = tuple(msgspec.structs.replace(marker, role=(marker.role or "").removeprefix(OTHER_HAND) or None)
                  for marker in own)
    return OneHand(anatomy, msgspec.structs.replace(rig.markers, markers=alone), columns, first)


def _unknown(state: HandState) -> HandState:
    """`state` with nothing known of the hand itself."""
    joints, tips = len(JOINTS), len(FINGERS)
    return replace(state, joint_positions=np.full((joints, 3), np.nan),
                   joint_knowledge=np.full(joints, Knowledge.UNKNOWN, np.uint8),
                   joint_covariances=np.full((joints, 3, 3), np.nan), fingertip_positions=np.full((tips, 3), np.nan),
                   fingertip_covariances=np.full((tips, 3, 3), np.nan), world_from_palm=np.full((4, 4), np.nan),
                   palm_knowledge=Knowledge.UNKNOWN)


# -- Tool tips of joints and ellipsoids --------------------------------------------------------------------------------

Array = NDArray[np.float64]

REACH_PX = 16.0


@dataclass(frozen=True, slots=True)
class Spot:
    """Something with a place: what it is called, how it is known, where (3,) m rig frame, covariance (3, 3) m^2."""

    name: str
    knowledge: Knowledge
    place: Array
    covariance: Array

    def text(self, by_calibration: CalibrationAccuracy) -> str:
        """Its tooltip."""
        spread = sd_text(float(total_sd(self.covariance, by_calibration)))
        unknown = by_calibration.reason or tr("its uncertainty is not estimated")
        lines = [f"{self.name}: {tr(KNOWLEDGE[self.knowledge].word)}",
                 tr("{spread} along the worst axis (one sigma)", spread=spread) if spread else unknown,
                 f"x, y, z: {position_text(self.place)}"]
        return "\n".join(lines)


def spots(state: HandState, hands: Sequence[str] = ("",)) -> list[Spot]:
    """Markers first, then the joints that no marker's middle stands for; `hands` are their names, "" for none."""
    found = [Spot(tr("marker {name}", name=marker_name(name)), Knowledge(int(state.marker_knowledge[k])),
                  state.marker_positions[k], state.marker_covariances[k]) for k, name in enumerate(state.marker_ids)]
    for name, hand in zip(hands, each_hand(state), strict=False):  # the other hand is not there with every tracker
        found += [Spot(f"{name} {joint_name(JOINTS[k])}".lstrip(), Knowledge(int(hand.joint_knowledge[k])),
                       hand.joint_positions[k], hand.joint_covariances[k])
                  for k in range(len(JOINTS)) if k not in TIPS]
    return [spot for spot in found if np.isfinite(spot.place).all()]


def joint_name(joint: str) -> str:
    """A joint as people say it: "index_pip" is "index PIP joint"."""
    finger, _, name = joint.partition("_")
    if not name:
        return tr("{finger} joint", finger=tr(finger))
    return tr("{finger} {name} joint", finger=tr(finger), name=name.upper())


def nearest(pixels: Array, at: tuple[float, float]) -> int | None:
    """Which of `pixels` (N, 2), NaN for none, lies nearest to `at` and within reach."""
    distances = np.linalg.norm(pixels - np.array(at), axis=1)
    distances = np.where(np.isfinite(distances), distances, np.inf)
    best = int(np.argmin(distances)) if len(distances) else 0
    return best if len(distances) and distances[best] <= REACH_PX else None
