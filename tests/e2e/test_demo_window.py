"""``rhot demo`` as a person starts it: a window with a moving hand, which may crash, and which cleans up behind itself.

With RHOT_UPDATE_SCREENSHOTS=1 the picture of the README is made anew.
"""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from bench import START_S, TEST_S, Bench, ends, kill_hard, states_of, wait_until
from patience import PATIENCE_S, eventually

from rhot_app.engine.client import EngineClient
from rhot_app.engine.directory import EngineDirectory
from rhot_app.engine.process import StartedProcess, start_ticks, started_processes
from rhot_app.state import Condition

PICTURES = Path(__file__).parents[2] / "docs" / "screenshots"
GRAB = """
import sys
from PySide6.QtGui import QGuiApplication
app = QGuiApplication(["grab"])
app.primaryScreen().grabWindow(0).save(sys.argv[1])
"""

pytestmark = [
    pytest.mark.timeout(2 * TEST_S),
    pytest.mark.skipif(not os.environ.get("DISPLAY"), reason="no screen: Xvfb is not installed"),
]


def grab(path: Path) -> np.ndarray:
    """The whole screen as (H, W, 3) BGR, also written to `path`."""
    subprocess.run([sys.executable, "-c", GRAB, str(path)], check=True, timeout=60, capture_output=True)
    picture = cv2.imread(str(path))
    assert picture is not None
    return np.asarray(picture)


def await_moving_hand(folder: Path, timeout_s: float = START_S) -> None:
    """Wait until a window shows a hand that moves: many colours, and many pixels that change."""
    scene = np.s_[80:540, 220:900]
    pictures = [grab(folder / "first.png")]

    def moves() -> bool:
        pictures.append(grab(folder / "now.png"))
        last, now = (picture[scene].astype(int) for picture in pictures[-2:])
        colours = np.unique((now >> 4) @ (1, 16, 256))
        return len(colours) > 200 and (np.abs(last - now).max(axis=2) > 40).sum() > 100

    eventually(moves, timeout_s, told=lambda: "no window shows a hand that moves")


def tracks(client: EngineClient) -> bool:
    """Whether the newest state is a hand that is being tracked."""
    state = client.state
    return state is not None and state.condition in (Condition.TRACKING, Condition.PARTIAL)


def alive(processes: list[StartedProcess]) -> list[str]:
    """Roles of those that still run."""
    return [process.role for process in processes if start_ticks(process.pid) == process.started_ticks]


def running_in(folder: Path) -> list[str]:
    """Command lines of all processes on this machine that name a test's folder."""
    lines = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            lines.append(path.read_bytes().replace(b"\0", b" ").decode(errors="replace"))
    return [line for line in lines if str(folder) in line]


def test_the_demo_shows_a_moving_hand_and_survives_crashes(bench: Bench) -> None:
    options = ["--directory", str(bench.sockets), "--settings", str(bench.folder / "layout.ini")]
    window = bench.start(["rhot_app", "demo", *options], "window")
    with EngineClient(bench.sockets) as client:
        wait_until(client, lambda: tracks(client), START_S, "the demo tracks the hand")
        await_moving_hand(bench.folder)
        if os.environ.get("RHOT_UPDATE_SCREENSHOTS") == "1":
            states_of(client, 30.0)  # until the plots are full
            grab(PICTURES / "demo.png")

        started = started_processes(EngineDirectory(bench.sockets))
        assert {process.role for process in started} >= {"engine"}
        assert sum("rhot_node" in line for line in running_in(bench.folder)) == 2
        kill_hard(window)
        client.poll(0.0)
        last_ns = client.state.t_master_ns
        wait_until(client, lambda: client.state.t_master_ns > last_ns + 500_000_000, PATIENCE_S,
                   "states go on without the window")
        assert len(alive(started)) == len(started), "engine and nodes outlive the window"

        second_window = bench.start(["rhot_app", *options], "second window")
        await_moving_hand(bench.folder)
        (engine,) = [process for process in started if process.role == "engine"]
        os.kill(engine.pid, 9)
        wait_until(client, lambda: client.status is not None and client.status.pid != engine.pid, START_S,
                   "the window starts another engine")
        wait_until(client, lambda: tracks(client), START_S, "the nodes join the new engine")

    second_window.terminate()
    assert ends(second_window, PATIENCE_S), bench.log("second window")
    eventually(lambda: not running_in(bench.folder), told=lambda: running_in(bench.folder))  # nothing is left running
