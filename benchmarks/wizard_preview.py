"""Whether the wizards' pictures stay live while a calibration is being solved, and whether the engine notices.

Starts the simulated rig, tracks, pulls full-size pictures of both cameras as the wizards do, and solves a stereo
calibration of 40 shots again and again in the solver's process, as the wizards do:

    python benchmarks/wizard_preview.py [--seconds 10] [--shots 40] [--json FILE]
"""

from __future__ import annotations

import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from tables import arguments, publish, table

from rhot_app.calibration.board.boards import STANDARD_BOARD
from rhot_app.calibration.board.corners import BoardView
from rhot_app.calibration.board.shared_views import BoardShot, SharedViews
from rhot_app.calibration.lens.fit import LensStart
from rhot_app.calibration.stereo.calibrate import calibrate
from rhot_app.engine.client import EngineClient
from rhot_app.engine.status import EngineStatus
from rhot_app.errors import RhotError
from rhot_app.geometry.camera import full_lens
from rhot_app.ui.backend.feed import LiveFeed
from rhot_app.ui.backend.session import Session, TwinChoice
from rhot_app.ui.backend.solver import Solver

NOISE_PX = 0.05
LENS = full_lens([530.0, 530.0, 319.5, 239.5, -0.1, 0.05])
BASELINE_M = 0.075


def shared_views(shots: int) -> SharedViews:
    """A board before two cameras, `shots` times, its corners known but for some noise."""
    board, random = STANDARD_BOARD, np.random.default_rng(1)
    points = board.object_points() - board.object_points().mean(axis=0)
    matrix = np.array([[LENS[0], 0, LENS[2]], [0, LENS[1], LENS[3]], [0, 0, 1.0]])
    taken = []
    for number in range(shots):
        turn = cv2.Rodrigues(random.uniform(-0.5, 0.5, 3))[0]
        place = np.array([*random.uniform(-0.08, 0.08, 2), random.uniform(0.5, 0.8)])
        views = []
        for camera in range(2):
            seen = points @ turn.T + place - [camera * BASELINE_M, 0, 0]
            pixels = cv2.projectPoints(seen, np.zeros(3), np.zeros(3), matrix, LENS[4:])[0].reshape(-1, 2)
            noisy = pixels + NOISE_PX * random.standard_normal(pixels.shape)
            views.append(BoardView(noisy, np.arange(board.count), 640, 480, 20.0, 2.0, f"shot {number}"))
        taken.append(BoardShot(f"shot {number}", tuple(views)))
    return SharedViews(("left", "right"), board, tuple(taken))


def watch(session: Session, feed: LiveFeed, seconds: float) -> dict[str, Any]:
    """Pictures per second, the longest wait for one, and the engine's own figures meanwhile."""
    arrivals: dict[str, list[float]] = {name: [] for name in feed.cameras}
    last: dict[str, int] = {}
    status: EngineStatus | None = None
    with EngineClient(session.directory, states=False) as client:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for name in feed.cameras:
                picture = feed.newest(name)
                if picture is not None and last.get(name) != picture.number:
                    last[name] = picture.number
                    arrivals[name].append(time.monotonic())
            for message in client.poll(0.005):
                status = message if isinstance(message, EngineStatus) else status
    gaps = {name: np.diff(times) for name, times in arrivals.items()}
    latency = status.latency.get("receive_to_state") if status is not None else None
    return {"pictures_hz": {name: round(1.0 / float(gap.mean()), 1) for name, gap in gaps.items()},
            "longest_wait_ms": {name: round(1e3 * float(gap.max())) for name, gap in gaps.items()},
            "states_hz": round(status.state_rate_hz, 1) if status is not None else None,
            "receive_to_state_p99_ms": round(1e3 * latency.p99_s, 2) if latency is not None else None}


def solve_again_and_again(solver: Solver, views: SharedViews, ending: threading.Event, took_s: list[float]) -> None:
    """Solve until told to end; the time of each."""
    lenses = [LensStart(LENS, (640, 480)) for _ in range(2)]
    while not ending.is_set():
        began = time.monotonic()
        solver.run(calibrate, (views, lenses), lambda text, fraction: None)
        took_s.append(time.monotonic() - began)


def measure(seconds: float, shots: int) -> dict[str, Any]:
    """Both halves: nothing but pictures, then beside the solver."""
    solver, ending, took_s = Solver(), threading.Event(), list[float]()
    with tempfile.TemporaryDirectory() as folder:
        session = Session(Path(folder))
        try:
            opened = session.open_twin(TwinChoice("grasp"), lambda text, fraction: None)
            with session.client() as client:
                client.command("start")
            cameras = {node.name: node.node_id for node in opened.rig.nodes}
            feed = LiveFeed(cameras, session.command_client, rate_hz=30.0).start()
            time.sleep(2.0)
            alone = watch(session, feed, seconds)
            worker = threading.Thread(target=solve_again_and_again,
                                      args=(solver, shared_views(shots), ending, took_s))
            worker.start()
            beside = watch(session, feed, seconds)
            ending.set()
            worker.join()
            feed.stop()
        finally:
            solver.stop()
            session.close()
    return {"alone": alone, "solving": beside, "shots": shots, "solve_s": [round(s, 2) for s in took_s]}


def main() -> int:
    """Print the table."""
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--shots", type=int, default=40)
    args = parser.parse_args()
    try:
        found = measure(args.seconds, args.shots)
    except RhotError as exc:
        print(f"wizard_preview: {exc}", file=sys.stderr)
        return 2
    publish(args, found, table(["", *found["alone"]], [[name, *map(str, found[name].values())]
                                                      for name in ("alone", "solving")]),
            f"Solving {args.shots} shots took {found['solve_s']} s.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
