"""A bare hand from pictures to states: two paired nodes search them, an engine tracks, each its own process."""

from __future__ import annotations

import contextlib
import time

import msgspec
import numpy as np
import pytest
from bare_scenes import model_and_surface, near, poses, rig_of, scene
from bench import START_S, TEST_S, Bench, messages_of, node_status, wait_until
from shipped_rig import RIGHT_HAND

from rhot_app.engine.client import EngineClient
from rhot_app.engine.offline.replay_summary import replay_states
from rhot_app.engine.status import Preview
from rhot_app.hand.kinematics import forward
from rhot_app.recording.raw_log import LogReader, RecordKind
from rhot_app.sources.replay import LogValidator
from rhot_app.state import HandState, SeenContour
from rhot_app.tracking.scene import make_tracker
from rhot_node.capture.yuv import YuvWriter
from rhot_node.detect.image import from_bgr
from rhot_node.files import write_atomically

FPS = 15.0
TIMES = tuple(k / 30.0 for k in range(14))
STILL = 360  # frames of the hand at rest, in which it is found, by a busy machine, too
MOVING = (*range(14), *range(13, -1, -1)) * 2
ORDER = (*([0] * STILL), *MOVING, *([0] * 30))
ERROR_MM = 8.0  # median joint; 1 when all is well
STATE_AGE_S = 0.3
COMMAND_S = 30.0  # a machine that has other things to do


def record(bench: Bench) -> None:
    """An empty scene, repeated until the recordings start, then the hand, at rest and moving."""
    drawn = [scene(pose, k) for k, pose in enumerate(poses("grasp", TIMES))]
    cameras, walls = drawn[0][0], drawn[0][2]
    for index, node in enumerate(rig_of(cameras).nodes):
        pictures = [walls[index], *(images[index] for _, images, _ in drawn)]
        planes = [from_bgr(picture[:, :, ::-1]) for picture in pictures]
        packed = [np.concatenate([one.y.ravel(), one.u.ravel(), one.v.ravel()]) for one in planes]
        name = bench.rig.nodes[index].name
        with YuvWriter(bench.folder / f"{name}.yuv", node.intrinsics.width, node.intrinsics.height, 4_000_000,
                       0) as out:
            for number, which in enumerate((-1, *ORDER)):
                out.append(round(1e9 * number / FPS), packed[1 + which])
    seen = rig_of(cameras, shown=[near(poses("grasp", TIMES)[0])])
    bench.rig = msgspec.structs.replace(
        bench.rig, hand=RIGHT_HAND, tracker=msgspec.structs.replace(seen.tracker, kind="estimator", observe="contours"),
        nodes=tuple(msgspec.structs.replace(node, intrinsics=other.intrinsics, pose=other.pose)
                    for node, other in zip(bench.rig.nodes, seen.nodes, strict=True)))
    bench.save()


@pytest.mark.study("rhot_app/barehand", "rhot_app/tracking/contours", "rhot_node/slice_search.py")
@pytest.mark.timeout(2 * TEST_S)
def test_a_bare_hand_is_tracked_by_what_its_nodes_find(bench: Bench) -> None:
    record(bench)
    begin, log = bench.folder / "begin", bench.folder / "hand.rlog"
    for index, node in enumerate(bench.rig.nodes):
        bench.start_node(index, f"yuv:{bench.folder / node.name}.yuv?start={begin}")
    bench.start_engine("--start")
    with EngineClient(bench.sockets) as client:
        wait_until(client, lambda: all((status := node_status(client, node.name)) is not None
                                       and status.state == "streaming" and status.rate_hz > 0.5 * FPS
                                       for node in bench.rig.nodes), 2 * START_S, "both nodes' frames")
        for node in bench.rig.nodes:
            client.command("node", node_id=node.node_id, request={"request": "learn_background", "seconds": 2.0},
                           timeout_s=COMMAND_S)

        def learnt() -> bool:
            answers = [client.command("node", node_id=node.node_id, request={"request": "state"},
                                      timeout_s=COMMAND_S)["answer"]
                       for node in bench.rig.nodes]
            return all(answer["foreground"]["background"] and not answer["foreground"]["learning_s"]
                       for answer in answers)
        wait_until(client, learnt, 20.0, "the background")
        client.command("record", timeout_s=COMMAND_S, path=str(log))
        t0_ns = time.monotonic_ns() + 500_000_000
        write_atomically(begin, str(t0_ns).encode())
        client.command("preview", on=True)
        received, previews, contours = [], [], set()
        while time.monotonic_ns() < t0_ns + 1e9 * (len(ORDER) + 1) / FPS:
            for message in messages_of(client, 0.05):
                if isinstance(message, HandState):
                    received.append((time.monotonic_ns(), message))
                elif isinstance(message, Preview):
                    previews.append(message)
                elif isinstance(message, SeenContour) and not message.shown:
                    contours.add((message.camera, message.t_node_ns))
        client.command("record_stop", timeout_s=COMMAND_S)
    model = model_and_surface()[0]
    moving = poses("grasp", TIMES)
    errors_mm, ages_s = [], []
    for t_received_ns, state in received:
        number = round(1e-9 * (state.t_master_ns - t0_ns) * FPS) - 1
        if state.tracked and STILL <= number < STILL + len(MOVING):
            truth = forward(model, moving[ORDER[number]]).joints
            errors_mm.append(1e3 * float(np.median(np.linalg.norm(state.joint_positions - truth, axis=1))))
            ages_s.append(1e-9 * (t_received_ns - state.t_master_ns))
    before = [state for _, state in received if state.t_master_ns < t0_ns]
    assert errors_mm, "the hand is tracked while it moves"
    rate_hz = len(errors_mm) * FPS / len(MOVING)
    assert before and not any(state.tracked for state in before), "there was no hand yet"
    assert rate_hz > 0.3 * FPS, "a busy machine may lose the hand once"
    assert np.median(errors_mm) < ERROR_MM
    assert np.median(ages_s) < STATE_AGE_S

    found_ns = {camera: min(t_ns for name, t_ns in contours if name == camera) for camera, _ in contours}
    shown = [(one.camera, one.t_node_ns) in contours for one in previews if one.t_node_ns >= found_ns[one.camera]]
    assert np.mean(shown) > 0.3, "pictures come with the contour that was found in them"

    with contextlib.closing(LogReader(log)) as reader:
        records = list(reader)
    assert any(one.kind is RecordKind.SLICES for one in records)
    again = [state for state in replay_states(records, LogValidator(bench.rig), make_tracker(bench.rig))
             if state.tracked and state.t_master_ns > t0_ns + 1e9 * (STILL + 10) / FPS]
    assert len(again) > 20, "the log replays"
    spread = [float(np.median(np.linalg.norm(state.joint_positions - forward(
        model, moving[ORDER[min(round(1e-9 * (state.t_master_ns - t0_ns) * FPS) - 1, len(ORDER) - 1)]]).joints,
        axis=1))) for state in again]
    assert 1e3 * np.median(spread) < ERROR_MM
