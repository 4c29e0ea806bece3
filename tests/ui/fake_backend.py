"""Processes that are none: what `Session` and `Solver` of `rhot_app.ui.backend` do, on a `FakeEngine` and at once."""

from __future__ import annotations

import pickle
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from fake_engine import FakeClient, FakeEngine

from rhot_app.errors import CalibrationError, RhotError, RigError, SimulatorError
from rhot_app.progress import Progress
from rhot_app.simulator.scene.scene_file import SceneFields, write_scene
from rhot_app.ui.backend.contract import Opened, TwinChoice, TwinPace
from rhot_app.ui.backend.solver import Solver, StoppedError


class InProcessSolver(Solver):
    """Works in the caller's thread: a process takes half a second to start. What goes there and back must pickle."""

    def __init__(self) -> None:
        super().__init__()
        self._stopped = threading.Event()

    def prepare(self, module: str) -> None:
        """There is nothing to start."""

    def run(self, function: Callable[..., Any], arguments: tuple[Any, ...], progress: Progress,
            options: Mapping[str, Any] | None = None) -> Any:
        self._stopped = stopped = threading.Event()

        def report(text: str, fraction: float) -> None:
            if stopped.is_set():
                raise StoppedError("Stopped.")
            progress(text, fraction)

        work, given, more = pickle.loads(pickle.dumps((function, arguments, dict(options or {}))))
        try:
            return pickle.loads(pickle.dumps(work(*given, progress=report, **more)))
        except StoppedError:
            raise
        except (RhotError, OSError) as exc:
            raise CalibrationError(str(exc)) from exc

    def stop(self) -> None:
        self._stopped.set()


class FakeBackend:
    """Opens at once unless `gate` is held by a test; `calls` lists what was asked."""

    def __init__(self, engine: FakeEngine | None = None) -> None:
        self.engine = engine or FakeEngine(running=False)
        self.calls: list[str] = []
        self.already_running, self.looks = False, 0
        self.ours = True
        self.alive = True
        self.pace: TwinPace | None = None
        self.refuse = ""
        self.covered: tuple[str, ...] = ()
        self.shown = "hand:grasp"
        self.gate = threading.Event()
        self.gate.set()

    def calm(self) -> None:
        """End all trouble; what runs and what was counted stays."""
        self.alive, self.refuse, self.pace = True, "", None
        self.gate.set()
        engine = self.engine
        engine.dead, engine.hidden, engine.advice, engine.log_path = False, {}, (), ""
        engine.running = True

    def client(self) -> FakeClient:
        return FakeClient(self.engine)

    def command_client(self) -> FakeClient:
        return FakeClient(self.engine)

    def found(self) -> bool:
        self.looks += 1
        return self.already_running

    def attach(self, progress: Progress) -> Opened:
        self.calls.append("attach")
        return self._opened("", simulated=False)

    def open_rig(self, path: Path, progress: Progress) -> Opened:
        self.calls.append(f"open {path.name}")
        self._work(progress)
        return self._opened(str(path), simulated=False)

    def open_twin(self, choice: TwinChoice, progress: Progress) -> Opened:
        self.calls.append(f"twin {choice.motion if choice.scene is None else choice.scene.name}")
        self._work(progress)
        return self._opened("", simulated=True)

    def restart_engine(self, path: str, start: bool, progress: Progress) -> Opened:
        self.calls.append(f"restart start={start}")
        self._work(progress)
        self.engine.dead = False
        self.engine.running = start
        return self._opened(path, simulated=True)

    def twin_alive(self) -> bool:
        return self.alive

    def twin_pace(self) -> TwinPace | None:
        return self.pace

    def covered_cameras(self) -> tuple[str, ...]:
        return self.covered

    def cover_cameras(self, names: tuple[str, ...]) -> tuple[str, ...]:
        if self.refuse:
            raise SimulatorError(self.refuse)
        self.covered = self.engine.black = names
        return names

    def shown_in_twin(self) -> str:
        return self.shown

    def show_in_twin(self, what: str) -> str:
        if self.refuse:
            raise SimulatorError(self.refuse)
        self.shown = what
        return what

    def save_scene(self, path: Path) -> None:
        if self.refuse:
            raise SimulatorError(self.refuse)
        write_scene(path, SceneFields({"lamp": {"kelvin": 3000.0}}, {"show": "hand", "motion": "wave"}, 7))

    def give_up(self) -> None:
        self.calls.append("give up")
        self.gate.set()

    def close(self) -> str:
        self.calls.append("close")
        return "" if self.ours else "The engine was not started by this app and goes on running."

    def _work(self, progress: Progress) -> None:
        progress("Starting the engine …", 0.4)
        self.gate.wait(10.0)
        if self.refuse:
            raise RigError(self.refuse)
        progress("Asking the engine for its rig …", 0.9)

    def _opened(self, path: str, *, simulated: bool) -> Opened:
        self.engine.rig_path = path
        return Opened(self.engine.rig, path, self.engine.running, self.ours, simulated)
