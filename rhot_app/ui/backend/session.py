"""The processes behind the window: which engine it talks to, what the app has started, and how all of it ends.

Every function that waits is meant for a worker thread; nothing here knows Qt.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from rhot_app.engine.activity import read_activity
from rhot_app.engine.client import EngineClient
from rhot_app.engine.compilation import compile_part, part_of
from rhot_app.engine.directory import EngineDirectory, open_directory
from rhot_app.engine.process import (
    StartedProcess,
    end_started,
    ensure_engine,
    remember_process,
    running_engine,
    started_processes,
)
from rhot_app.errors import EngineError, RecordingError, RhotError, SimulatorError, SourceError
from rhot_app.progress import Progress
from rhot_app.project import load_rig, parse_rig, save_rig, with_tracker
from rhot_app.sources.cameras.camera_set import camera_set_of
from rhot_app.ui.backend.contract import Opened, TwinChoice, TwinPace
from rhot_app.ui.language import tr, tr_noop
from rhot_node.compiled import WINDOW
from rhot_node.terminal import before

if TYPE_CHECKING:
    from rhot_app.simulator.nodes.remote import TwinRemote
    from rhot_app.simulator.scene.scene_description import Show

ENGINE_ROLE = "engine"
TWIN_ROLE = "simulated nodes"
CAMERAS_ROLE = "cameras"
COMPILER_ROLE = "compiler"
START_TIMEOUT_S = 360.0
"""A slow or busy machine takes long, above all where compiled code cannot be kept."""

ANSWER_S = 5.0
"""An engine answers within a fraction of this on a busy computer; one that does not hangs."""

HUNG_S = 0.5
"""Between asking a process that hangs to end and killing it."""

TWIN_COMMAND: tuple[str, ...] = (sys.executable, "-m", "rhot_app.simulator.nodes.live")
TWIN_RIG = "simulated.rig.json"
TWIN_OUTPUT = "twin.out"
CAMERAS_COMMAND: tuple[str, ...] = (sys.executable, "-m", "rhot_app.sources.cameras.serve")
CAMERAS_OUTPUT = "cameras.out"


class Session:
    """Engine and simulated nodes in one private directory."""

    def __init__(self, directory: Path | None = None) -> None:
        self._place: EngineDirectory = open_directory(directory)
        self._twin_started = False

    @property
    def directory(self) -> Path:
        """The engine's directory."""
        return self._place.path

    @property
    def processes(self) -> list[StartedProcess]:
        """What the app has started here and runs."""
        return started_processes(self._place)

    def client(self) -> EngineClient:
        """A client for this directory; it outlives restarts of the engine."""
        return EngineClient(self._place.path)

    def command_client(self) -> EngineClient:
        """A client for this directory that only gives commands."""
        return EngineClient(self._place.path, states=False, events=False)

    def found(self) -> bool:
        """Whether an engine runs here."""
        return running_engine(self._place.path) is not None

    def attach(self, progress: Progress) -> Opened:
        """Attach to the engine that runs here, whoever started it; raises EngineError when it does not answer."""
        progress(tr("Attaching to the running engine …"), 0.5)
        ours = self._engine_is_ours()
        with EngineClient(self._place.path, states=False) as client:
            hello = client.command("hello")
            answer = client.command("rig")
            client.command("preview", on=True)
        path = str(answer.get("path", ""))
        rig = parse_rig(msgspec.json.encode(answer["document"]), path or "the engine's rig")
        simulated = any(process.role == TWIN_ROLE for process in started_processes(self._place))
        self._twin_started = simulated
        return Opened(rig, path, bool(hello.get("running")), ours, simulated)

    def open_rig(self, path: Path, progress: Progress) -> Opened:
        """End what the app ran before and start an engine on `path`, and before it the cameras of this computer that
        belong to that rig; raises RigError, SourceError or EngineError."""
        progress(tr("Reading the rig file …"), 0.1)
        rig, cameras = load_rig(path), camera_set_of(path)
        self._clear(progress)
        self._compile(part_of(rig), progress)
        if cameras is None:
            return self._start_engine(path, progress)
        self._start_cameras(path, len(cameras.cameras), progress)
        return dataclasses.replace(self._start_engine(path, progress), begin=True)

    def open_twin(self, choice: TwinChoice, progress: Progress) -> Opened:
        """Start the simulated nodes, then an engine on the rig that they write; raises SimulatorError, EngineError."""
        if choice.scene is not None:
            from rhot_app.simulator.scene.scene_file import read_scene

            fields = read_scene(choice.scene)
            if choice.motion is not None:
                fields.set("show.motion", choice.motion, "show.motion")
            fields.require()  # what cannot be is said while the other rig still runs
        self._clear(progress)
        self._compile(WINDOW, progress)
        progress(tr("Starting two simulated cameras …"), 0.15)
        rig_path = self._start_twin(choice, progress)
        rig = with_tracker(load_rig(rig_path), choice.tracker)
        save_rig(rig_path, rig)
        self._compile(part_of(rig), progress)
        return self._start_engine(rig_path, progress)

    def restart_engine(self, path: str, start: bool, progress: Progress) -> Opened:
        """Start the engine again after it died or hangs: on the same rig, and it continues what it recorded. `start`
        has it tell the nodes to stream at once."""
        if not path:
            raise EngineError(tr("The engine had no rig file, so it cannot be started again. Open a rig."))
        progress(tr("Starting the engine again …"), 0.3)
        if self.found() and self._recorded_log() is None:
            self._require_ours()
            end_started(self._place, [ENGINE_ROLE], HUNG_S)
        ensure_engine(Path(path), self._place.path, start=start, resume=True, timeout_s=START_TIMEOUT_S)
        return self.attach(progress)

    def twin_alive(self) -> bool:
        """True unless simulated nodes were started and have ended since."""
        return not self._twin_started or any(process.role == TWIN_ROLE for process in started_processes(self._place))

    def twin_pace(self) -> TwinPace | None:
        """What the simulated nodes said last about falling short of their preset; None when nothing."""
        return pace_in(self._place.path / TWIN_OUTPUT) if self._twin_started else None

    def covered_cameras(self) -> tuple[str, ...]:
        """Which simulated cameras have a cap on their lens; raises SimulatorError when the twin gives no answer."""
        with self._twin() as twin:
            return twin.state().covered

    def cover_cameras(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Cover these simulated cameras, and uncover the others; returns which are covered. Raises SimulatorError."""
        with self._twin() as twin:
            return twin.cover(*names).covered

    def shown_in_twin(self) -> str:
        """What stands before the simulated cameras; raises SimulatorError when the twin gives no answer."""
        with self._twin() as twin:
            return key_of(twin.state().show)

    def show_in_twin(self, what: str) -> str:
        """Show something else, from its beginning (`contract.Backend`); raises SimulatorError."""
        show = show_named(what)
        with self._twin() as twin:
            return key_of(twin.show(show).show)

    def save_scene(self, path: Path) -> None:
        """The scene that the twin was started with, with what it shows now and its lamp, as a file. Raises
        SimulatorError."""
        from rhot_app.simulator.nodes.remote import SCENE_NAME
        from rhot_app.simulator.scene.scene_file import read_scene, write_scene

        with self._twin() as twin:
            now = twin.state()
        fields = read_scene(self._place.path / SCENE_NAME)
        fields.show = msgspec.to_builtins(now.show)
        if now.lamp != fields.scene().settings.lamp:
            fields.settings["lamp"] = msgspec.to_builtins(now.lamp)
        try:
            write_scene(path, fields)
        except OSError as exc:
            raise SimulatorError(tr("{out}: cannot be written ({strerror}); nothing was saved.", out=path,
                                    strerror=exc.strerror)) from exc

    def give_up(self) -> None:
        """End everything that the app started; what waits for it then fails and is forgotten."""
        self._twin_started = False
        end_started(self._place)

    def close(self) -> str:
        """End all that apps started here. An engine that somebody started by hand goes on."""
        left = self.found() and not self._engine_is_ours()
        self.give_up()
        return (tr("The engine in {path} was not started by this app and goes on running.", path=self._place.path)
                if left else "")

    def _twin(self) -> TwinRemote:
        from rhot_app.simulator.nodes.remote import TwinRemote  # with OpenCV, which most commands do without

        return TwinRemote(self._place.path)

    def _engine_is_ours(self) -> bool:
        pid = running_engine(self._place.path)
        return any(process.pid == pid for process in started_processes(self._place))

    def _clear(self, progress: Progress) -> None:
        if self.found():
            self._require_ours()
            self._require_not_recording()
        progress(tr("Ending what ran before …"), 0.12)
        self._twin_started = False
        end_started(self._place)

    def _require_not_recording(self) -> None:
        """Raises RecordingError when the engine that is to be replaced records, or did when it fell silent."""
        log_path = self._recorded_log()
        if log_path:
            raise RecordingError(tr("The engine in {path} records to {log_path}. Stop that recording first, or start "
                                    "with another --directory.", path=self._place.path, log_path=log_path))
        activity = read_activity(self._place) if log_path is None else None
        if activity is not None and activity.log_path:
            pid = running_engine(self._place.path)
            raise RecordingError(tr("The engine in {path} records to {log_path} and gives no answer in {limit:g} s. "
                                    "Try again, or end it with `kill {pid}`; what it has recorded is kept.",
                                    path=self._place.path, log_path=activity.log_path, limit=ANSWER_S, pid=pid))

    def _recorded_log(self) -> str | None:
        """What the running engine records, "" for nothing; None when it gives no answer."""
        with contextlib.suppress(EngineError), self.command_client() as client:
            return str(client.command("status", timeout_s=ANSWER_S)["status"]["log_path"])
        return None

    def _require_ours(self) -> None:
        if not self._engine_is_ours():
            raise EngineError(tr("An engine that was started by hand runs in {path}. Stop it first, or start the app "
                                 "with another --directory.", path=self._place.path))

    def _compile(self, part: str, progress: Progress) -> None:
        compile_part(part, progress, lambda pid: remember_process(self._place, pid, COMPILER_ROLE))

    def _start_engine(self, path: Path, progress: Progress) -> Opened:
        progress(tr("Starting the engine …"), 0.5)
        ensure_engine(path, self._place.path, timeout_s=START_TIMEOUT_S)
        progress(tr("Asking the engine for its rig …"), 0.9)
        return self.attach(lambda text, fraction: None)

    def _start_twin(self, choice: TwinChoice, progress: Progress) -> Path:
        """Start the twin in the background."""
        rig_path, output = self._place.path / TWIN_RIG, self._place.path / TWIN_OUTPUT
        errors = self._place.twin_log_file
        chosen = {"--scene": choice.scene, "--motion": choice.motion, "--seed": choice.seed, "--preset": choice.preset}
        command = [*TWIN_COMMAND, *(text for name, value in chosen.items() if value is not None
                                    for text in (name, str(value))),
                   "--directory", str(self._place.path), "--rig", str(rig_path),
                   "--while-locked", str(self._place.lock_file)]
        self._start_nodes(command, TWIN_ROLE, output, errors, _Words(tr_noop("simulated cameras"), 2, SimulatorError),
                          progress)
        self._twin_started = True
        return rig_path

    def _start_cameras(self, rig_path: Path, count: int, progress: Progress) -> None:
        """Start the nodes of this computer's cameras in the background."""
        errors = self._place.cameras_log_file
        command = [*CAMERAS_COMMAND, "--rig", str(rig_path.absolute()), "--log", str(errors), "--while-locked",
                   str(self._place.lock_file)]
        self._start_nodes(command, CAMERAS_ROLE, self._place.path / CAMERAS_OUTPUT, errors,
                          _Words(tr_noop("cameras"), count, SourceError), progress)

    def _start_nodes(self, command: list[str], role: str, output: Path, errors: Path, words: _Words,
                     progress: Progress) -> None:
        """Start a process that runs nodes, and wait for its ready line, which goes to a file so that it outlives this
        process."""
        with contextlib.suppress(OSError):
            errors.replace(before(errors))
        with output.open("wb") as out, errors.open("ab") as log:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=out, stderr=log,
                                       start_new_session=True)
        remember_process(self._place, process.pid, role)
        try:
            _await_ready(process, output, errors, words, progress)
        except BaseException:
            end_started(self._place, [role])
            raise


@dataclasses.dataclass(frozen=True, slots=True)
class _Words:
    """How nodes are called that are being started, how many they are, and the error when they do not start."""

    what: str
    count: int
    error: type[RhotError]


def _await_ready(process: subprocess.Popen[bytes], output: Path, errors: Path, words: _Words,
                 progress: Progress) -> None:
    begin = time.monotonic()
    while time.monotonic() - begin < START_TIMEOUT_S:
        if _has_ready_line(output):
            return
        if process.poll() is not None:
            lines = errors.read_text(errors="replace").strip().splitlines()
            said = lines[-1] if lines else tr("they said nothing; see {errors}", errors=errors)
            raise words.error(tr("The {what} did not start: {said}", what=tr(words.what), said=said))
        progress(tr("Starting {n} camera …", "Starting {n} cameras …", words.count),
               0.15 + 0.3 * min(1.0, (time.monotonic() - begin) / 15.0))
        time.sleep(0.05)
    raise words.error(tr("The {what} were not ready within {limit:.0f} s; see {errors}.", what=tr(words.what),
                         limit=START_TIMEOUT_S, errors=errors))


def show_named(what: str) -> Show:
    """The show of a key; raises SimulatorError for a key that is none."""
    from rhot_app.simulator.scene.scene_description import (
        BareHandShow,
        BoardShow,
        EmptyShow,
        HandShow,
        MarkerShow,
        RulerShow,
    )

    kind, _, detail = what.partition(":")
    with contextlib.suppress(ValueError):
        match kind:
            case "hand" | "held":
                return HandShow(detail, kind == "held")
            case "bare":
                return BareHandShow(detail)
            case "board":
                return BoardShow()
            case "table":
                return BoardShow(on_table=True)
            case "empty":
                return EmptyShow()
            case "ruler":
                return RulerShow()
            case "marker":
                return MarkerShow(distance_m=float(detail))
    raise SimulatorError(tr("The simulated rig has no {what!r} to show.", what=what))


def key_of(show: Show) -> str:
    """The key of a show; "" for one that has none."""
    from rhot_app.simulator.scene.scene_description import (
        BareHandShow,
        BoardShow,
        EmptyShow,
        HandShow,
        MarkerShow,
        RulerShow,
    )

    if isinstance(show, HandShow):
        return f"{'held' if show.cube else 'hand'}:{show.motion}"
    if isinstance(show, BareHandShow):
        return f"bare:{show.motion}" if show == BareHandShow(show.motion) else ""
    if isinstance(show, MarkerShow):
        return f"marker:{show.distance_m:g}" if show == MarkerShow(distance_m=show.distance_m) else ""
    return {BoardShow(): "board", BoardShow(on_table=True): "table", RulerShow(): "ruler",
            EmptyShow(): "empty"}.get(show, "")


def pace_in(output: Path) -> TwinPace | None:
    """The newest whole line about the pace: ``{"event": "slow", "achieved_hz": …, "preset_hz": …}``, or "in_time"."""
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        whole_lines, _, _ = output.read_text().rpartition("\n")
        for line in reversed(whole_lines.splitlines()):
            event = json.loads(line)
            if event.get("event") == "in_time":
                return None
            if event.get("event") == "slow":
                return TwinPace(float(event["achieved_hz"]), float(event["preset_hz"]))
    return None


def _has_ready_line(output: Path) -> bool:
    """Whether the twin has printed a whole JSON object."""
    with contextlib.suppress(OSError, ValueError):
        line, newline, _ = output.read_text().partition("\n")
        return bool(newline) and isinstance(json.loads(line), dict)
    return False

