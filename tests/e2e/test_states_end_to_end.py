"""Two nodes with clocks of their own, an engine, a client, each its own process: a moving hand arrives in time."""

from __future__ import annotations

import time

import cv2
import numpy as np
import pytest
from bench import CLOCKS, FPS, START_S, TEST_S, Bench, messages_of, node_status, wait_until
from scene import PERIOD_S, Scene

from rhot_app.engine.client import EngineClient
from rhot_app.engine.status import Preview
from rhot_app.state import HandState, Knowledge
from rhot_node.files import write_atomically
from rhot_node.markers import MarkerSet

SETTLING_S = 0.7  # of the hand's motion
MARKER_RMS_MM = 1.0  # of the unfiltered positions; 0.3 when all is well, 1.3 when states are 10 ms off
STATE_AGE_S = 0.15
PREVIEW_PX = 2.0  # of the frame, in a picture of half the size; the hand moves 4 px from frame to frame


@pytest.mark.timeout(TEST_S)
def test_a_moving_hand_arrives_at_the_cameras_rate(bench: Bench) -> None:
    """For the time of one swing. A busy machine leaves frames out: the quicker part of the states tells the rate and
    the delay."""
    scene = Scene(bench.rig, amplitude_m=0.06)
    begin = bench.folder / "begin"
    for index, node in enumerate(bench.rig.nodes):
        scene.record(bench.folder / f"{node.name}.yuv", node, SETTLING_S + PERIOD_S + 0.1)
        bench.start_node(index, f"yuv:{bench.folder / node.name}.yuv?start={begin}")
    bench.start_engine("--start")
    received, previews = [], []
    with EngineClient(bench.sockets) as client:
        wait_until(client, lambda: client.state is not None, START_S, "the first state")
        client.command("preview", on=True)
        t0_ns = time.monotonic_ns() + 500_000_000
        write_atomically(begin, str(t0_ns).encode())
        begun_ns, ended_ns = t0_ns + round(1e9 * SETTLING_S), t0_ns + round(1e9 * (SETTLING_S + PERIOD_S))
        while client.state.t_master_ns < ended_ns:
            came = messages_of(client, 0.02)
            received += [(time.monotonic_ns(), state) for state in came
                         if isinstance(state, HandState) and begun_ns <= state.t_master_ns < ended_ns]
            previews += [one for one in came if isinstance(one, Preview) and begun_ns <= one.t_master_ns < ended_ns]
        for name, clock in zip(("left", "right"), CLOCKS, strict=True):
            status = node_status(client, name)
            assert status is not None and status.clock_offset_s is not None
            assert abs(status.clock_offset_s) == pytest.approx(abs(clock.offset_s), abs=0.01)

    errors_mm, ages_s = [], []
    for t_received_ns, state in received:
        truth_m = scene.markers_m(1e-9 * (state.t_master_ns - t0_ns))
        measured = state.marker_knowledge == Knowledge.MEASURED
        errors_mm.append(1e3 * (state.marker_raw_positions - truth_m)[measured])
        ages_s.append(1e-9 * (t_received_ns - state.t_master_ns))
    rms_mm = float(np.sqrt((np.concatenate(errors_mm) ** 2).sum(axis=1).mean()))
    assert sum(map(len, errors_mm)) > 0.95 * 6 * len(received), "markers that both cameras see count as measured"
    assert rms_mm < MARKER_RMS_MM
    steps_s = 1e-9 * np.diff([state.t_master_ns for _, state in received])
    assert (steps_s > 0.0).all() and len(received) <= 2.05 * FPS * PERIOD_S
    assert np.percentile(steps_s, 25) < 1.05 / FPS
    assert np.percentile(ages_s, 25) < STATE_AGE_S
    assert {one.camera for one in previews} == {"left", "right"}
    apart_px = np.concatenate([one.pixels - discs(one, bench.rig.markers) for one in previews])
    assert np.nanmax(np.abs(apart_px)) < PREVIEW_PX, "what was found is drawn over the picture in which it was found"


def discs(preview: Preview, markers: MarkerSet) -> np.ndarray:
    """(M, 2) px of the frame: where the markers' colours are in a preview, in which four pixels are one."""
    image = cv2.imdecode(np.frombuffer(preview.jpeg, np.uint8), cv2.IMREAD_COLOR)
    crcb = cv2.cvtColor(image, cv2.COLOR_BGR2YCrCb)[..., 1:].astype(float) - 128.0
    scale = preview.width / image.shape[1]
    near = [np.linalg.norm(crcb - (one.chroma.cr, one.chroma.cb), axis=2) < 20.0 for one in markers.markers]
    return np.array([scale * (np.argwhere(one).mean(axis=0)[::-1] + 0.5) - 0.5 for one in near])
