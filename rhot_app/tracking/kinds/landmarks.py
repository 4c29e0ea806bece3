"""Hand landmarks of a camera as observations of the rig's markers that are landmarks, live and from films."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.estimation.track import LOST_NS
from rhot_app.hand.places import LANDMARK_ROLES
from rhot_app.project import OTHER_HAND, Rig
from rhot_app.tracking.kinds.kind import FrameTimes, Kind
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import HandLandmarks, LandmarkedHand, MarkerFlag

Array = NDArray[np.float64]

DIAMETER_PX = 1.0
"""A landmark has no diameter; 1 px stands for it."""

SIDE_S: Final = 0.2
"""s: time constant of the averaged side of a hand, so that a flicker turns no hand into the other one.
Chosen: it holds against four wrong frames of 30 a second, and is turned round within half a second."""

PROBABILITY_MAX: Final = 0.98
"""Probability of a side beyond which a frame counts no more."""

ASSOCIATION_GATE: Final = 0.5
"""Mean distance of landmarks from where a hand is predicted, as a part of its extent, from which it is another one."""

HYSTERESIS: Final = 1.0
"""Log odds by which another hand must be likelier to take a hand's place: 73 to 27 %."""


@dataclass(slots=True, eq=False)
class _Track:
    """One hand in the frames of a camera. `points` (21, 2) px at `t_ns`, NaN where there is none; `velocity` (2,)
    px/ns; `right`: mean log odds that it is a right one; `hand`: which of the rig's it was last, None: none;
    `mistaken`: the last frame showed another hand in its place."""

    t_ns: int
    points: Array
    velocity: Array
    right: float
    hand: int | None = None
    mistaken: bool = False

    def distance(self, points: Array, t_ns: int) -> float:
        """Mean distance of landmarks (21, 2) px from where they are expected, as a part of their extent."""
        off = np.linalg.norm(points - self.points - self.velocity * (t_ns - self.t_ns), axis=1)
        shared = np.isfinite(off)
        if not shared.any():
            return math.inf
        extent = float(np.ptp(points[np.isfinite(points[:, 0])], axis=0).max())
        return float(off[shared].mean()) / max(extent, 1.0)

    def covers(self, points: Array, t_ns: int) -> bool:
        """Whether its box overlaps that of landmarks (21, 2) px."""
        there = self.points + self.velocity * (t_ns - self.t_ns)
        return bool(np.all((np.nanmin(there, axis=0) < np.nanmax(points, axis=0))
                           & (np.nanmin(points, axis=0) < np.nanmax(there, axis=0))))

    def follow(self, points: Array, right: float, t_ns: int) -> None:
        """Take what a later frame shows of the hand."""
        since_ns = t_ns - self.t_ns
        if since_ns > 0:
            shared = np.isfinite(points[:, 0] + self.points[:, 0])
            self.velocity = (points - self.points)[shared].mean(axis=0) / since_ns
            self.right += (1.0 - math.exp(-1e-9 * since_ns / SIDE_S)) * (right - self.right)
            self.t_ns, self.points = t_ns, points


class LandmarkKind(Kind):
    """See `Kind`: the rig's markers that are landmarks. Their residual is that of markers.

    Hands are followed from frame to frame by their landmarks; those of the rig are told by the side that the networks
    have said of them lately.
    """

    name = "landmarks"
    messages = (HandLandmarks,)

    def configure(self, rig: Rig, camera: int) -> None:
        """See `Kind`."""
        super().configure(rig, camera)
        self._count = len(rig.markers.markers)
        self._hands: list[tuple[bool, NDArray[np.intp], NDArray[np.intp]]] = []  # right; markers; their landmarks
        self._tracks: list[_Track] = []
        for hand, prefix in ((rig.hand, ""), (rig.other_hand, OTHER_HAND)):
            roles = [f"{prefix}{role}" for role in LANDMARK_ROLES]
            rows = [(k, roles.index(marker.role)) for k, marker in enumerate(rig.markers.markers)
                    if marker.role in roles]
            if hand is not None and rows:
                markers, landmarks = np.array(rows, np.intp).T
                self._hands.append((hand.side == "right", markers, landmarks))

    def refusal(self, message: Any) -> str | None:
        """A rig without landmarks."""
        return None if self._hands else "no_landmarks"

    def observe(self, collected: Any, times: FrameTimes) -> CameraObservations:
        """The landmarks of one frame; all other markers are lost."""
        message: HandLandmarks = collected
        pixels, covariances = np.full((self._count, 2), np.nan), np.zeros((self._count, 2, 2))
        diameters, qualities = np.zeros(self._count), np.zeros(self._count)
        flags = np.full(self._count, MarkerFlag.LOST, np.uint16)
        assigned = self._assigned(message.hands, times.t_row0_ns)
        for (_, markers, landmarks), found in zip(self._hands, assigned, strict=True):
            if found is None:
                continue
            points = np.array(found.points)[landmarks]
            shown = points[:, 2] > 0.0
            points, own = points[shown], markers[shown]
            pixels[own] = points[:, :2]
            covariances[own] = points[:, [2, 3, 3, 4]].reshape(-1, 2, 2)
            diameters[own], qualities[own], flags[own] = DIAMETER_PX, found.presence, 0
        return CameraObservations(
            camera=self.camera, t_row0_master_ns=times.t_row0_ns, row_time_ns=message.row_time_ns,
            clock_bound_s=times.bound_s, t_receive_ns=times.t_receive_ns, detect_s=1e-9 * message.processing_ns,
            network_s=1e-9 * (times.t_receive_ns - times.t_send_ns), pixels=pixels, covariances=covariances,
            diameters=diameters, qualities=qualities, flags=flags)

    def _assigned(self, found: Sequence[LandmarkedHand], t_ns: int) -> list[LandmarkedHand | None]:
        """Which hand of a frame is which of the rig's: the assignment with the greatest sum of log odds of their sides,
        in favour of what they were before. None where no hand is likelier than none. While two hands overlap, one whose
        side contradicts its track is left out: the network may have fitted it to the hand in front."""
        tracks = self._followed(found, t_ns)
        mistaken = set()
        for k, (one, track) in enumerate(zip(found, tracks, strict=True)):
            doubt = HYSTERESIS if track.mistaken else -HYSTERESIS
            track.mistaken = (_log_odds(one.right) * math.copysign(1.0, track.right) < doubt
                              and any(other is not track and other.covers(track.points, t_ns)
                                      for other in self._tracks))
            if track.mistaken:
                mistaken.add(k)
        best: tuple[int | None, ...] = (None,) * len(self._hands)
        most = 0.0
        for choice in product((None, *range(len(found))), repeat=len(self._hands)):
            chosen = [k for k in choice if k is not None]
            if len(set(chosen)) < len(chosen) or mistaken.intersection(chosen):
                continue
            gain = 0.0
            for number, k in enumerate(choice):
                if k is not None:
                    gain += tracks[k].right if self._hands[number][0] else -tracks[k].right
                    gain += HYSTERESIS if tracks[k].hand == number else 0.0
            if gain > most:
                most, best = gain, choice
        for k, track in enumerate(tracks):
            if k not in mistaken:
                track.hand = best.index(k) if k in best else None
        return [None if k is None else found[k] for k in best]

    def _followed(self, found: Sequence[LandmarkedHand], t_ns: int) -> list[_Track]:
        """The track of each hand of a frame: the nearest one, or a new one."""
        self._tracks = [track for track in self._tracks if abs(t_ns - track.t_ns) < LOST_NS]
        hands = []
        for one in found:
            points = np.array(one.points)
            points[points[:, 2] <= 0.0] = np.nan
            hands.append((points[:, :2], _log_odds(one.right)))
        pairs = sorted((track.distance(points, t_ns), k, number) for number, track in enumerate(self._tracks)
                       for k, (points, _) in enumerate(hands))
        of_hand: dict[int, _Track] = {}
        for distance, k, number in pairs:
            if distance < ASSOCIATION_GATE and k not in of_hand and self._tracks[number] not in of_hand.values():
                of_hand[k] = self._tracks[number]
        for k, (points, right) in enumerate(hands):
            if k in of_hand:
                of_hand[k].follow(points, right, t_ns)
            else:
                of_hand[k] = _Track(t_ns, points, np.zeros(2), right)
                self._tracks.append(of_hand[k])
        return [of_hand[k] for k in range(len(found))]


def _log_odds(right: float) -> float:
    odds = min(max(right, 1.0 - PROBABILITY_MAX), PROBABILITY_MAX)
    return math.log(odds / (1.0 - odds))
