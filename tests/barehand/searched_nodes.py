"""Nodes that search drawn pictures for a tracker, as slice_search does, without sockets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rhot_app.barehand.observations import EdgeFrame, ForegroundFrame, SliceRequest
from rhot_app.state import HandState
from rhot_app.tracking.tracker import CameraFrame, CameraObservations, ImageTracking, Tracker, solve_after
from rhot_node.detect.edges import find_edges, noise_of
from rhot_node.detect.foreground import Foreground, foreground_map

PERIOD_NS = 33_333_333
FIRST_NS = 10**9


class SearchedNodes:
    """Hands the frames of some cameras to a tracker, and does what it asks for; with `forget`, it gives requests back
    as a log has them. `rounded_ns`: by which the times of edges and maps differ from those of the markers."""

    def __init__(self, tracker: Tracker, foreground: list[Foreground], markers: int, *, forget: bool = False,
                 rounded_ns: int = 0) -> None:
        assert isinstance(tracker, ImageTracking)
        tracker.warm_up()
        self.tracker, self.foreground, self.markers, self.forget = tracker, foreground, markers, forget
        self.rounded_ns = rounded_ns
        self.asked: list[SliceRequest | None] = [None] * len(foreground)
        self.states: list[HandState] = []

    def step(self, number: int, images: list[np.ndarray | None], pixels: list[np.ndarray] | None = None,
             seen: list[CameraObservations] | None = None) -> None:
        """One frame of each camera, None of one that gives none; `pixels` (M, 2) of its markers, or all that is `seen`
        of them at another time."""
        t_ns = FIRST_NS + number * PERIOD_NS
        for camera, image in enumerate(images):
            if image is None:
                continue
            request, known, searched_ns = self.asked[camera], self.foreground[camera], t_ns + self.rounded_ns
            if seen is not None:
                self.give(replace(seen[camera], t_row0_master_ns=t_ns, t_receive_ns=t_ns + 9_000_000))
            else:
                self.give(seen_at(camera, t_ns, np.full((self.markers, 2), np.nan) if pixels is None
                                  else pixels[camera]))
            if request is None:
                continue
            if len(request.slices):
                found = find_edges(image, request.slices, known, noise_of(image))
                told = replace(request, expected=None) if self.forget else request
                self.give(EdgeFrame(camera, searched_ns, 0, t_ns + 9_000_000, 0.004, 0.001, told, found))
            if request.map_step:
                self.give(ForegroundFrame(camera, searched_ns, 0, t_ns + 9_000_000, request.map_step,
                                          foreground_map(image, known, request.map_step)))

    def give(self, frame: CameraFrame) -> None:
        assert isinstance(self.tracker, ImageTracking)
        state = solve_after(self.tracker, frame)
        if state is not None:
            self.states.append(state)
        for request in self.tracker.requests():
            self.asked[request.camera] = request


def seen_at(camera: int, t_ns: int, pixels: np.ndarray) -> CameraObservations:
    """Markers at `pixels` (M, 2), NaN for lost."""
    count = len(pixels)
    return CameraObservations(
        camera, t_ns, 0, 1e-4, t_ns + 9_000_000, 0.004, 0.001, pixels, np.tile(0.01 * np.eye(2), (count, 1, 1)),
        np.full(count, 12.0), np.ones(count), np.isnan(pixels[:, 0]).astype(np.uint16))
