"""How long no states come after the app's engine was killed while it recorded, on the simulated rig.

    python benchmarks/engine_restart.py [--kills 3] [--tracker estimator] [--json FILE]
"""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import tables
from PySide6.QtCore import QCoreApplication

from rhot_app.engine.process import running_engine
from rhot_app.recording.raw_log import LogReader
from rhot_app.ui.backend.contract import TwinChoice
from rhot_app.ui.backend.session import Session
from rhot_app.ui.common.controller import Controller

RESTART_MAX_S = 6.0
PATIENCE_S = 300.0
BETWEEN_S = 3.0  # of recording
TURN_S = 0.01


class Bench:
    """The app without its window."""

    def __init__(self, directory: Path) -> None:
        self.app = QCoreApplication([])
        self.session = Session(directory)
        self.controller = Controller(self.session)

    def until(self, condition: Callable[[], object]) -> float:
        """Turn until `condition`; returns the seconds since the epoch of the monotonic clock."""
        end_s = time.monotonic() + PATIENCE_S
        while not condition():
            if time.monotonic() > end_s:
                raise SystemExit(f"nothing came of it in {PATIENCE_S:.0f} s. {self.controller.problem}")
            self.app.processEvents()
            self.controller.step()
            time.sleep(TURN_S)
        return time.monotonic()

    def restarted(self, log: Path) -> dict[str, float]:
        """Kill the engine; returns seconds until that was noticed, until an engine answered and until states came."""
        end_s = time.monotonic() + BETWEEN_S
        self.until(lambda: time.monotonic() > end_s)
        pid, live = running_engine(self.session.directory), self.controller.live
        if pid is None:
            raise SystemExit("there is no engine to kill.")
        os.kill(pid, signal.SIGKILL)
        killed_s = time.monotonic()
        noticed_s = self.until(lambda: self.controller.busy is not None)
        answered_s = self.until(lambda: self.controller.busy is None)
        states_s = self.until(lambda: live.state_count > 0)
        self.until(lambda: live.status is not None)
        if live.status is None or live.status.log_path in ("", str(log)):
            raise SystemExit("the recording was not continued.")
        return {"noticed": noticed_s - killed_s, "answered": answered_s - killed_s, "states": states_s - killed_s}


def main() -> int:
    """Kill the engine several times; 1 when states are missing for too long."""
    parser = tables.arguments(__doc__)
    parser.add_argument("--kills", type=int, default=3)
    parser.add_argument("--tracker", choices=("classic", "estimator"), default="classic")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="rhot-") as work:
        bench, log = Bench(Path(work) / "engine"), Path(work) / "take.rhotlog"
        controller = bench.controller
        try:
            controller.open_twin(TwinChoice(tracker=args.tracker))
            bench.until(lambda: controller.live.state_count > 0)
            controller.record(log)
            bench.until(lambda: controller.recording)
            kills = [bench.restarted(log) for _ in range(args.kills)]
        finally:
            controller.shut_down()
        parts = [LogReader(path) for path in sorted(Path(work).glob("*.rhotlog"))]
        records = [sum(1 for _ in part) for part in parts]
    rows = [[number, *kill.values()] for number, kill in enumerate(kills, 1)]
    tables.publish(args, {"kills": kills, "records": records},
                   tables.table(["kill", "noticed after, s", "an engine answers, s", "states come, s"],
                                [*rows, ["aim", None, None, RESTART_MAX_S]]),
                   f"The recording has {len(parts)} parts of {', '.join(map(str, records))} records.")
    return int(max(kill["states"] for kill in kills) > RESTART_MAX_S or 0 in records)


if __name__ == "__main__":
    sys.exit(main())
