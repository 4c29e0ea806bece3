"""A rig of two hands and a state of both, taken apart for what draws one hand: each as if it were alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.skeleton import FINGERS, JOINTS
from rhot_app.project import OTHER_HAND, Rig
from rhot_app.tracking.state import HandState, Knowledge
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
