"""States of a bare hand as they are published: with the rig's markers, which say nothing, and the cameras' pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rhot_app.barehand.observations import EdgeFrame
from rhot_app.state import HandState, Knowledge
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.wire.messages import MarkerFlag


def published(hand: HandState, sequence: int, frame: CameraObservations | EdgeFrame,
              newest: Sequence[CameraObservations | None], marker_ids: tuple[str, ...], cameras: tuple[str, ...],
              filter_s: float) -> HandState:
    """The state of a hand that `frame` has completed, with what the cameras saw of M markers; where these are in space
    is not said."""
    count = len(marker_ids)
    pixels = np.full((len(cameras), count, 2), np.nan)
    flags = np.full((len(cameras), count), int(MarkerFlag.LOST), np.uint16)
    for number, one in enumerate(newest):
        if one is not None:
            pixels[number], flags[number] = one.pixels, one.flags
    return replace(
        hand, sequence=sequence, t_receive_ns=frame.t_receive_ns, marker_ids=marker_ids,
        marker_positions=np.full((count, 3), np.nan), marker_raw_positions=np.full((count, 3), np.nan),
        marker_covariances=np.full((count, 3, 3), np.nan),
        marker_knowledge=np.full(count, int(Knowledge.UNKNOWN), np.uint8), camera_names=cameras, camera_pixels=pixels,
        camera_flags=flags, epipolar_error_px=np.full(count, np.nan),
        latency_s={"detect": frame.detect_s, "network": frame.network_s, "pair": 0.0, "triangulate": 0.0,
                   "filter": filter_s, "solve": 0.0})
