"""Compiles the numerical code into numba's cache, so that nothing waits for it later.

``python -m rhot_app.warm`` compiles everything, on all processors. ``python -m rhot_app.warm window`` compiles what the
window needs on the simulated rig, or another of `PARTS`. ``--background`` uses one processor, only while it is idle.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import os
import signal
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from multiprocessing import get_context, parent_process
from typing import get_args

import msgspec
import numpy as np

from rhot_app.calibration.board.boards import STANDARD_BOARD
from rhot_app.calibration.board.corners import detect
from rhot_app.calibration.filters.tuning import OFF, Footage, simulate
from rhot_app.calibration.hand.bundle_model import POSE, Poses, linearise
from rhot_app.calibration.hand.marker_places import PALM, MarkerPlace
from rhot_app.calibration.hand.shape import HandUnknowns
from rhot_app.engine.pipeline import warm_up as warm_up_tracker
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model, neutral_pose
from rhot_app.hand.skeleton import ANGLES
from rhot_app.hand.solvers.finger_ik import solve_fingers
from rhot_app.hand.solvers.palm_fit import fit_palm
from rhot_app.outputs.joints import JointConverter
from rhot_app.project import IkMethod, Rig, TrackerSettings, load_rig
from rhot_app.simulator.film.shot import make_renderer, make_shot
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.simulator.scene.scene_description import BareHandShow, BoardShow, HandShow
from rhot_app.tracking.scene import make_tracker
from rhot_node.clock import NodeClock
from rhot_node.compiled import ALL, VARIABLE, WINDOW, is_complete, mark_complete
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.tags import TagDetector
from rhot_node.detectors import warm_up as warm_up_detector
from rhot_node.files import resource_path
from rhot_node.foreground_store import ForegroundStore
from rhot_node.markers import load_markers
from rhot_node.slice_search import SliceSearch
from rhot_node.tag_search import warm_up_picture
from rhot_node.threads import OneShotThread
from rhot_node.wire.messages import FAMILIES


def warm_detector(rig: Rig) -> None:
    """Compile what a node does with a frame."""
    camera = rig.nodes[0].intrinsics
    warm_up_detector(FastDetector(rig.markers), rig.markers, (camera.width, camera.height))


def warm_searches(_rig: Rig) -> None:
    """Compile how a node searches for tags and for the edges of a bare hand, which it does before it is ready."""
    SliceSearch(0, NodeClock(), ForegroundStore(None)).warm_up()
    TagDetector((FAMILIES[0],)).detect(warm_up_picture(FAMILIES[0]))


def warm_tracker(rig: Rig) -> None:
    """Compile what the engine does with observations."""
    warm_up_tracker(make_tracker(rig), rig)


def warm_solvers(_rig: Rig) -> None:
    """Compile the solvers of both trackers; `warm_tracker` needs them last, so both steps can run side by side."""
    hand, pose = build_model(load_hand(resource_path("hands", "right.json"))), neutral_pose()
    points = forward(hand, pose)
    fit_palm(hand, points.joints[0], points.marker_centres, pose, 1.0 / 30.0)
    solve_fingers(hand, pose, points.marker_centres)


def warm_other_solvers(rig: Rig) -> None:
    """Compile the classic tracker's other methods of inverse kinematics."""
    for ik in get_args(IkMethod):
        chosen = msgspec.structs.replace(rig, tracker=TrackerSettings(kind="classic", ik=ik))
        warm_up_tracker(make_tracker(chosen), chosen)


def warm_estimator(rig: Rig) -> None:
    """Compile the estimator with the search for the hand's size, initialised with and without palm markers."""
    for markers in ("rhot6", "rhot8"):
        chosen = msgspec.structs.replace(rig, markers=load_markers(resource_path("markers", f"{markers}.json")),
                                         tracker=TrackerSettings(kind="estimator", float_scale=True))
        warm_up_tracker(make_tracker(chosen), chosen)


def warm_twin(_rig: Rig) -> None:
    """Compile what the digital twin draws with."""
    scene = make_scene(twin_defaults(), seed=1)
    for show in (HandShow("rest"), BareHandShow("rest"), BoardShow(on_table=True)):
        shot = make_shot(scene, show, seconds=1.0)
        make_renderer(shot, 0).render(shot.scene_object.source, t_row0_s=0.0, number=0)


def warm_boards(_rig: Rig) -> None:
    """Compile the search for calibration boards, on a synthetic picture of one."""
    board = STANDARD_BOARD
    squares = np.add.outer(np.arange(board.rows + 1), np.arange(board.cols + 1)) % 2 * 200 + 20
    detect(np.pad(np.kron(squares, np.ones((24, 24))).astype(np.uint8), 48, constant_values=230), board, thorough=False)


def warm_calibrations(rig: Rig) -> None:
    """Compile the calibrations of bones and filters."""
    hand = load_hand(resource_path("hands", "right.json"))
    unknowns = HandUnknowns(hand, (MarkerPlace("index", 1, 2, painted=True), MarkerPlace("back", PALM, PALM)))
    still = Poses(np.eye(4)[None], np.zeros((1, len(ANGLES))))
    linearise(unknowns, unknowns.prior.mean, still.moved(np.zeros((1, POSE))))
    models = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
    footage = Footage(np.arange(3.0), np.full((3, len(models), 1, 2), 100.0),
                      np.array([model.intrinsics for model in models]),
                      np.array([model.camera_from_world[:3] for model in models]))
    simulate(footage, np.array([OFF]), np.array([OFF]))


def warm_bare_hand(rig: Rig) -> None:
    """Compile the trackers of a bare hand, and its fit to pictures."""
    # not above: nothing of these files is compiled, so they decide no cache
    from rhot_app.handfit.session import warm_up

    warm_up(rig, contours=True)
    settings = TrackerSettings(kind="estimator", observe="contours")
    make_tracker(msgspec.structs.replace(rig, tracker=settings, other_hand=rig.hand)).warm_up()


def warm_outputs(rig: Rig) -> None:
    """Compile the conversion of a hand to the joints of other programs."""
    JointConverter(rig).warm_up()


STEPS: dict[str, Callable[[Rig], None]] = {"tracker": warm_tracker, "solvers": warm_solvers,
                                           "detector": warm_detector, "twin": warm_twin, "outputs": warm_outputs,
                                           "searches": warm_searches,
                                           "estimator": warm_estimator, "bare hand": warm_bare_hand,
                                           "boards": warm_boards, "calibrations": warm_calibrations,
                                           "other solvers": warm_other_solvers}
"""In this order two processes take equally long, and neither compiles what the other is compiling."""

PARTS: dict[str, tuple[str, ...]] = {
    WINDOW: ("tracker", "solvers", "detector", "twin", "searches", "outputs"), ALL: tuple(STEPS),
    "estimator": ("estimator",), "contours": ("bare hand",), "other solvers": ("other solvers",)}
"""Steps by the name of what they compile together."""

_COLLECT_EVERY = 100_000
"""Threshold of garbage collection, objects; 700 by default. A compiler makes millions of objects that stay, and
collecting costs 7 % of the time. The price is a few hundred MB of memory."""


def warm(name: str) -> str:
    """Run one of `STEPS` on the example rig; returns a line with its duration."""
    begun = time.monotonic()
    gc.set_threshold(_COLLECT_EVERY)
    STEPS[name](load_rig(resource_path("rigs", "two_pis.json")))
    return f"{name}: {time.monotonic() - begun:.1f} s"


def end_on_interrupt() -> None:
    """Have this process end at Ctrl-C at once: the pool would go on, as its workers return exceptions as results."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def start_worker() -> None:
    """Have this process end when its parent has ended, for whatever reason, and at Ctrl-C."""
    end_on_interrupt()
    parent = parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    OneShotThread("ends with its parent", watch)


def yield_processor() -> None:
    """Have this process, and those it starts, use idle processor time only: SCHED_IDLE on Linux, niceness elsewhere."""
    with contextlib.suppress(OSError):
        os.nice(19)
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))


def main(arguments: Sequence[str] | None = None) -> int:
    """Compile a part; prints a line after each step. Returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m rhot_app.warm", description="Compile the numerical code.")
    parser.add_argument("part", nargs="?", choices=PARTS, default=ALL, help=f"what to compile (default {ALL})")
    parser.add_argument("--background", action="store_true", help="use one processor, and only while it is idle")
    args = parser.parse_args(arguments)
    if args.background:
        yield_processor()
    steps = [name for name in PARTS[args.part] if not is_complete(name)]
    workers = 1 if args.background else min(len(steps), os.cpu_count() or 1)
    try:
        _compile(steps, max(1, workers))
    except OSError as exc:
        print(f"rhot: {os.environ.get(VARIABLE, 'compiled code')}: {exc.strerror or exc}. 200 MB must be free there. "
              "Start again then; what has been compiled stays.", file=sys.stderr)
        return 2
    for part, names in PARTS.items():
        if all(map(is_complete, names)):
            mark_complete(part)
    return 0


STILL_S = 2.0
"""s: how often it is said that a step, which may take a minute, is still being compiled."""


def _compile(steps: Sequence[str], workers: int) -> None:
    """Run the steps in processes of their own; prints a line after each, and now and then while none ends."""
    begun_s, done = time.monotonic(), 0
    print(f"0 of {len(steps)} steps compiled", flush=True)
    with ProcessPoolExecutor(workers, get_context("spawn"), start_worker) as pool:
        running = {pool.submit(warm, name): name for name in steps}
        waiting = set(running)
        while waiting:
            ended, waiting = wait(waiting, STILL_S, FIRST_COMPLETED)
            for step in ended:
                line = step.result()
                mark_complete(running[step])
                done += 1
                print(f"{done} of {len(steps)} steps compiled; {line}", flush=True)
            if not ended:
                print(f"{done} of {len(steps)} steps compiled, {time.monotonic() - begun_s:.0f} s so far", flush=True)


if __name__ == "__main__":
    end_on_interrupt()
    sys.exit(main())
