"""An engine without processes whose rig has two hands: the left one is the right one's mirror image beside it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import cv2
import msgspec
import numpy as np
from fake_engine import FakeEngine, synthetic_rig

from rhot_app.engine.observer import condition_of
from rhot_app.engine.status import Preview
from rhot_app.hand.anatomy import load_hand
from rhot_app.project import OTHER_HAND, Rig, TrackerSettings
from rhot_app.state import Condition, HandState, Knowledge
from rhot_node.files import resource_path
from rhot_node.markers import Marker

ASIDE = np.array([-0.19, 0.0, 0.0])
"""From the right hand to the left one, m, rig frame."""

_PLACES = ("joint_positions", "fingertip_positions", "marker_positions", "marker_raw_positions")
_HAND = ("joint_positions", "joint_covariances", "fingertip_positions", "fingertip_covariances", "world_from_palm",
         "angles", "angle_sd", "palm_covariance", "marker_positions", "marker_raw_positions", "marker_covariances")
_KINDS = ("joint_knowledge", "angle_knowledge", "marker_knowledge")
_PER_MARKER = ("marker_positions", "marker_raw_positions", "marker_covariances", "marker_knowledge",
               "epipolar_error_px")


def one_hand_rig() -> Rig:
    """The test bench's rig with the estimator."""
    return msgspec.structs.replace(synthetic_rig(), tracker=TrackerSettings(kind="estimator"))


def two_hand_rig() -> Rig:
    """The same with a left hand, whose markers stand before the right one's: nobody may rely on their order."""
    rig = one_hand_rig()
    others = tuple(_on_other_hand(marker) for marker in rig.markers.markers)
    return msgspec.structs.replace(rig, other_hand=load_hand(resource_path("hands", "left.json")),
                                   markers=msgspec.structs.replace(rig.markers, markers=others + rig.markers.markers))


def _on_other_hand(marker: Marker) -> Marker:
    paler = tuple((channel + 255) // 2 for channel in marker.display_rgb)
    return msgspec.structs.replace(marker, id=f"left {marker.id}", role=f"{OTHER_HAND}{marker.role}",
                                   display_rgb=paler)


def lost(state: HandState) -> HandState:
    """The same hand out of sight."""
    unknown: dict[str, Any] = {name: np.full_like(getattr(state, name), np.nan) for name in _HAND}
    unknown |= {name: np.full_like(getattr(state, name), Knowledge.UNKNOWN) for name in _KINDS}
    return replace(state, condition=Condition.LOST, palm_knowledge=Knowledge.UNKNOWN, **unknown)


def merged(hand: HandState, other: HandState) -> HandState:
    """What the tracker of two hands makes of both."""
    arrays = {name: np.concatenate([getattr(other, name), getattr(hand, name)]) for name in _PER_MARKER}
    return replace(hand, marker_ids=other.marker_ids + hand.marker_ids, other=other, **arrays,
                   camera_pixels=np.concatenate([other.camera_pixels, hand.camera_pixels], axis=1),
                   camera_flags=np.concatenate([other.camera_flags, hand.camera_flags], axis=1))


class TwoHandsEngine(FakeEngine):
    """`gone` names the hands that are out of sight: "right", "left"."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(two_hand_rig(), **settings)
        left = load_hand(resource_path("hands", "left.json"))
        self._right = FakeEngine(one_hand_rig())
        self._left = FakeEngine(msgspec.structs.replace(one_hand_rig(), hand=left))
        self.gone: set[str] = set()

    def state(self, t_s: float) -> HandState:
        """Both hands; the left one is two seconds behind the right one."""
        self.sequence += 1
        hand, other = self._right.state(t_s), self._left.state(t_s - 2.0)
        aside = np.eye(4)
        aside[:3, 3] = ASIDE
        other = replace(other, t_master_ns=hand.t_master_ns, world_from_palm=aside @ other.world_from_palm,
                        marker_ids=self.rig.markers.ids[:len(other.marker_ids)],
                        **{name: getattr(other, name) + ASIDE for name in _PLACES})
        whole = merged(lost(hand) if "right" in self.gone else hand, lost(other) if "left" in self.gone else other)
        pixels, flags, _ = self._sights(whole.marker_positions)
        return replace(whole, sequence=self.sequence, camera_pixels=pixels, camera_flags=flags)

    def condition(self) -> Condition:
        """As the engine says it of both."""
        return condition_of(self.state(0.0)) if self.running else Condition.IDLE

    def preview(self, camera: int, t_s: float) -> Preview:
        """A picture of nothing."""
        _, jpeg = cv2.imencode(".jpg", np.full((240, 320, 3), 60, np.uint8))
        return Preview(self.rig.nodes[camera].name, round(t_s * 1e9), 640, 480, jpeg.tobytes())
