"""`./run` on a virtual screen ends without a word and leaves no screen behind, however it is ended."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from patience import PATIENCE_S, eventually

RUN = Path(__file__).resolve().parents[2] / "run"
FUNCTIONS = ("say", "fail", "on_virtual_screen", "close_screen")

WINDOW = """
import signal, sys, time
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication, QWidget
app = QApplication([])
window = QWidget()
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, lambda *_: QTimer.singleShot(0, app.quit))
ticks = QTimer()
ticks.timeout.connect(lambda: None)
ticks.start(20)
window.show()
QTimer.singleShot(50, lambda: print("shown", flush=True))
app.exec()
time.sleep(0.2)  # the app ends its engine while it still holds the screen
QApplication.primaryScreen().grabWindow(window.winId())
print("ended well", flush=True)
"""

pytestmark = pytest.mark.skipif(not all(shutil.which(name) for name in ("Xvfb", "xauth", "setpriv", "mcookie")),
                                reason="needs Xvfb, xauth, setpriv and mcookie")


@pytest.fixture
def script(tmp_path):
    """The script's own functions around a small window instead of the app."""
    text = RUN.read_text()
    parts = [re.search(rf"^{name}\(\) (\{{.*\}}|\{{\n.*?^\}})$", text, re.MULTILINE | re.DOTALL if name in FUNCTIONS[2:]
                       else re.MULTILINE) for name in FUNCTIONS]
    (tmp_path / "window.py").write_text(WINDOW)
    path = tmp_path / "run"
    path.write_text("set -euo pipefail\n" + "\n".join(part[0] for part in parts if part)
                    + f"\non_virtual_screen {sys.executable} {tmp_path}/window.py\n")
    return path


def heed_hang_ups() -> None:
    """As in a terminal, though the tests were started with nohup: what is ignored then, a shell cannot take note of."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def start(script: Path) -> tuple[subprocess.Popen[str], Path]:
    """The script with its window shown, and the folder of its screen."""
    environment = {key: value for key, value in os.environ.items() if key not in ("DISPLAY", "QT_QPA_PLATFORM")}
    process = subprocess.Popen(["bash", str(script)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                               env=environment, start_new_session=True, preexec_fn=heed_hang_ups)
    assert process.stderr is not None and process.stdout is not None
    where = re.search(r"XAUTHORITY=(.*)/client", process.stderr.readline())
    assert where is not None and process.stdout.readline() == "shown\n"
    return process, Path(where[1])


def screens(folder: Path) -> list[int]:
    """Process ids of the Xvfb that uses `folder`."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if entry.name.isdigit() and f"{folder}/server".encode() in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
        except OSError:
            continue
    return found


@pytest.mark.parametrize("how", ["Ctrl-C", "Ctrl-C twice", "kill", "hang up"])
def test_an_ended_run_says_nothing_and_leaves_nothing(script, how):
    process, folder = start(script)
    assert len(screens(folder)) == 1
    if how.startswith("Ctrl-C"):
        os.killpg(process.pid, signal.SIGINT)
        if how.endswith("twice"):
            time.sleep(0.05)
            os.killpg(process.pid, signal.SIGINT)
    else:
        process.send_signal(signal.SIGTERM if how == "kill" else signal.SIGHUP)
    out, err = process.communicate(timeout=PATIENCE_S)
    assert (out, err) == ("ended well\n", "")
    assert screens(folder) == [] and not folder.exists()


def test_a_client_that_leaves_before_the_window_opens_leaves_the_screen(script):
    window = f"{sys.executable} {script.parent}/window.py"
    client = f"{sys.executable} -c 'from PySide6.QtWidgets import QApplication; QApplication([])'"
    script.write_text(script.read_text().replace(window, f'bash -c "{client}; exec {window}"'))
    process, _folder = start(script)
    process.terminate()
    out, err = process.communicate(timeout=PATIENCE_S)
    assert (out, err) == ("ended well\n", "")


def test_a_killed_run_takes_window_and_screen_along(script):
    script.write_text(script.read_text().replace("-terminate 30", "-terminate 1"))  # s to wait for other clients
    process, folder = start(script)
    process.kill()
    out, err = process.communicate(timeout=PATIENCE_S)
    assert (out, err) == ("ended well\n", "")
    eventually(lambda: screens(folder) == [])
    shutil.rmtree(folder)
