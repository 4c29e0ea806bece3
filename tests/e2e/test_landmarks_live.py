"""A recorded bare hand from two films to states: two nodes run the hand networks, an engine tracks, each a process."""

from __future__ import annotations

import time

import msgspec
import numpy as np
import pytest
from bench import START_S, TEST_S, Bench, messages_of, node_status, wait_until
from recorded_landmarks import FOLDER, FPS, WHOLE, needs_recording, recording

from rhot_app.engine.client import EngineClient
from rhot_app.state import HandState
from rhot_node.config import load_settings, save_settings
from rhot_node.files import write_atomically
from rhot_node.landmarks.install import installed_folder

FRAMES = 120
PASSES = 3  # of the films, 4 s each
TRACKED = 60  # states; 600 when all is well
ERROR_MM = 15.0  # median joint from where the landmarks of another detector triangulate to; 8 when all is well


@needs_recording
@pytest.mark.skipif(installed_folder() is None, reason="the hand networks are not installed: rhot landmarks install")
@pytest.mark.study("rhot_node/landmark_search.py", "rhot_node/landmarks", "rhot_app/tracking/pairing.py")
@pytest.mark.timeout(TEST_S)
def test_a_bare_hand_in_two_films_is_tracked_live(bench: Bench) -> None:
    seen = recording()  # its second camera is the left one
    bench.rig = msgspec.structs.replace(
        bench.rig, markers=seen.rig.markers, hand=seen.rig.hand, tracker=seen.rig.tracker,
        nodes=tuple(msgspec.structs.replace(node, intrinsics=other.intrinsics, pose=other.pose)
                    for node, other in zip(bench.rig.nodes, reversed(seen.rig.nodes), strict=True)))
    bench.save()
    begin = bench.folder / "begin"
    for index, node in enumerate(bench.rig.nodes):
        path = bench.settings_path(node)
        save_settings(path, msgspec.structs.replace(load_settings(path), detector="landmarks"))
        bench.start_node(index, f"{FOLDER / f'cam{1 - index}_first120.mp4'}?start={begin}")
    bench.start_engine("--start")
    states: list[HandState] = []
    with EngineClient(bench.sockets) as client:
        wait_until(client, lambda: all((status := node_status(client, node.name)) is not None
                                       and status.state == "streaming" for node in bench.rig.nodes),
                   START_S, "both nodes stream")
        t0_ns = time.monotonic_ns() + 500_000_000
        write_atomically(begin, str(t0_ns).encode())
        end_ns = t0_ns + round(1e9 * PASSES * FRAMES / FPS)
        while time.monotonic_ns() < end_ns + 1_000_000_000:
            states += [one for one in messages_of(client, 0.1)
                       if isinstance(one, HandState) and t0_ns <= one.t_master_ns < end_ns]
    errors_mm = []
    for state in states:
        frame = round(1e-9 * (state.t_master_ns - t0_ns) * FPS) % FRAMES
        if state.tracked and WHOLE <= frame < WHOLE + len(seen.places):
            errors_mm.append(1e3 * np.linalg.norm(state.joint_positions - seen.places[frame - WHOLE], axis=1))
    assert len(errors_mm) > TRACKED
    assert np.median(errors_mm) < ERROR_MM
