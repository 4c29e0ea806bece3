"""The 3-D mouse from the simulated hand to its outputs: twin, nodes, engine and command as processes."""

from __future__ import annotations

import json
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from pythonosc.osc_bundle import OscBundle

ROOT = Path(__file__).parents[2]
MOUSE = sys.executable, "-m", "rhot_app", "mouse", "run", "--simulated", "--json"

BARE_S = 400.0
"""After so long a hand that does not work the mouse fails the test; the command itself looks for it for 360 s."""


@pytest.mark.study("rhot_app/mouse", "rhot_app/simulator/nodes")
def test_the_simulated_hand_works_the_mouse_by_itself() -> None:
    """The cursor moves, and OSC says the same."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(1.0)
        done = subprocess.run([*MOUSE, "--seconds", "10", "--osc", f"127.0.0.1:{receiver.getsockname()[1]}"],
                              capture_output=True, text=True, check=False, cwd=ROOT)
        heard = {message.address for message in OscBundle(receiver.recv(65536))}
    assert done.returncode == 0, done.stderr
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    cursors = np.array([line["cursor_m"] for line in lines if line["cursor_m"] is not None])
    assert len(cursors) > 10 and np.ptp(cursors[:, 0]) > 0.05
    assert "/rhot/mouse/buttons" in heard
    assert "from the hand to the cursor" in done.stderr


@pytest.mark.study("rhot_app/barehand", "rhot_app/tracking/contours", "rhot_app/mouse")
@pytest.mark.timeout(BARE_S + 60.0)
def test_the_simulated_bare_hand_works_the_mouse_live() -> None:
    """The same without markers, before cameras that are not synchronised and have rolling shutters, for as long as a
    busy machine needs."""
    with subprocess.Popen([*MOUSE, "--bare"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          cwd=ROOT) as running:
        late = threading.Timer(BARE_S, running.kill)
        late.start()
        places, moved_m = [], 0.0
        for line in running.stdout:
            cursor = json.loads(line)["cursor_m"]
            if cursor is not None:
                places.append(cursor[0])
                moved_m = max(places) - min(places)
            if moved_m > 0.05 and len(places) > 10:
                running.send_signal(signal.SIGINT)
                break
        _, notes = running.communicate()
        late.cancel()
    assert moved_m > 0.05 and len(places) > 10, notes
    assert running.returncode == 0, notes
    for stage in ("a simulated rig and an engine start", "learn the empty scene", "waiting until", "is tracked"):
        assert stage in notes
