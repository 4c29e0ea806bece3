"""Hand landmarks of a node as observations of the rig's markers that are landmarks."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.places import LANDMARK_ROLES
from rhot_app.project import OTHER_HAND, Rig
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import HandLandmarks, LandmarkedHand, MarkerFlag

DIAMETER_PX = 1.0
"""A landmark has none."""

_HALF = 0.5  # below it, a hand is rather of the other side


class LandmarkMarkers:
    """Which of a rig's markers are landmarks, and of which hand."""

    def __init__(self, rig: Rig) -> None:
        self._count = len(rig.markers.markers)
        self._hands: list[tuple[bool, NDArray[np.intp], NDArray[np.intp]]] = []  # right; markers; their landmarks
        for hand, prefix in ((rig.hand, ""), (rig.other_hand, OTHER_HAND)):
            roles = [f"{prefix}{role}" for role in LANDMARK_ROLES]
            rows = [(k, roles.index(marker.role)) for k, marker in enumerate(rig.markers.markers)
                    if marker.role in roles]
            if hand is not None and rows:
                markers, landmarks = np.array(rows, np.intp).T
                self._hands.append((hand.side == "right", markers, landmarks))

    def __bool__(self) -> bool:
        return bool(self._hands)

    def observations(self, message: HandLandmarks, camera: int, t_row0_ns: int, t_send_ns: int, t_receive_ns: int,
                     bound_s: float) -> CameraObservations:
        """The landmarks of one frame; all other markers are lost. Times are in master ns."""
        pixels, covariances = np.full((self._count, 2), np.nan), np.zeros((self._count, 2, 2))
        diameters, qualities = np.zeros(self._count), np.zeros(self._count)
        flags = np.full(self._count, MarkerFlag.LOST, np.uint16)
        for (_, markers, landmarks), found in zip(self._hands, self._assigned(message.hands), strict=True):
            if found is None:
                continue
            points = np.array(found.points)[landmarks]
            shown = points[:, 2] > 0.0
            points, own = points[shown], markers[shown]
            pixels[own] = points[:, :2]
            covariances[own] = points[:, [2, 3, 3, 4]].reshape(-1, 2, 2)
            diameters[own], qualities[own], flags[own] = DIAMETER_PX, found.presence, 0
        return CameraObservations(
            camera=camera, t_row0_master_ns=t_row0_ns, row_time_ns=message.row_time_ns, clock_bound_s=bound_s,
            t_receive_ns=t_receive_ns, detect_s=1e-9 * message.processing_ns,
            network_s=1e-9 * (t_receive_ns - t_send_ns), pixels=pixels, covariances=covariances, diameters=diameters,
            qualities=qualities, flags=flags)

    def _assigned(self, found: Sequence[LandmarkedHand]) -> list[LandmarkedHand | None]:
        """Which hand of a frame is which of the rig's: the likeliest by their sides. None: rather none of them."""
        best: tuple[LandmarkedHand | None, ...] = (None,) * len(self._hands)
        most = 0.0
        for choice in product((None, *range(len(found))), repeat=len(self._hands)):
            chosen = [k for k in choice if k is not None]
            if len(set(chosen)) < len(chosen):
                continue
            gain = sum((found[k].right if is_right else 1.0 - found[k].right) - _HALF
                       for k, (is_right, _, _) in zip(choice, self._hands, strict=True) if k is not None)
            if gain > most:
                most, best = gain, tuple(None if k is None else found[k] for k in choice)
        return list(best)
