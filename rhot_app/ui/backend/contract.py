"""What the window needs of the processes behind it, and the words for it; `session.Session` is the real one.

Every function that takes a `Progress` waits, and is meant for a worker thread.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol

from rhot_app.engine.status import Published
from rhot_app.progress import Progress
from rhot_app.project import Rig


@dataclass(frozen=True, slots=True)
class Opened:
    """A rig that is open now. `ours` is False when somebody else started the engine: closing leaves it running.
    `begin`: its cameras are of this computer and were started with it, so that tracking may begin at once."""

    rig: Rig
    rig_path: str
    running: bool
    ours: bool
    simulated: bool
    begin: bool = False


@dataclass(frozen=True, slots=True)
class TwinChoice:
    """What the simulated rig is. Where there is a `scene` file, None leaves to the file what it says."""

    motion: str | None = "grasp"
    seed: int | None = 1
    preset: str | None = "wide"
    tracker: Literal["classic", "estimator"] = "classic"
    scene: Path | None = None


@dataclass(frozen=True, slots=True)
class TwinPace:
    """How fast the simulated cameras are rendered when that is slower than their preset asks for."""

    achieved_hz: float
    preset_hz: float


class CommandClient(Protocol):
    """Gives commands to the engine; one per thread."""

    def command(self, name: str, *, timeout_s: float = 3.0, **arguments: Any) -> dict[str, Any]:
        """Ask the engine; raises EngineError."""
        ...

    def close(self) -> None:
        """Disconnect."""
        ...


Connect = Callable[[], CommandClient]
"""Makes a client for the thread that calls it."""


class Listener(Protocol):
    """Hears what the engine publishes; one per thread."""

    def poll(self) -> list[Published]:
        """Everything that arrived since the last call; never waits."""
        ...

    def close(self) -> None:
        """Disconnect."""
        ...


class Backend(Protocol):
    """All that the window asks of engine and simulated nodes."""

    def client(self) -> Listener:
        """A client that hears the hand's states."""
        ...

    def command_client(self) -> CommandClient:
        """A client that only gives commands; for workers, each its own."""
        ...

    def found(self) -> bool:
        """Whether an engine runs already that the window should attach to."""
        ...

    def attach(self, progress: Progress) -> Opened:
        """Attach to the running engine."""
        ...

    def open_rig(self, path: Path, progress: Progress) -> Opened:
        """Start an engine on a rig file, and before it the cameras of this computer that belong to it."""
        ...

    def open_twin(self, choice: TwinChoice, progress: Progress) -> Opened:
        """Start simulated nodes and an engine on their rig."""
        ...

    def restart_engine(self, path: str, start: bool, progress: Progress) -> Opened:
        """Start the engine again after it vanished."""
        ...

    def twin_alive(self) -> bool:
        """Whether the simulated nodes, if any were started, still run."""
        ...

    def twin_pace(self) -> TwinPace | None:
        """How fast the simulated cameras are rendered; None when as fast as they should be."""
        ...

    def covered_cameras(self) -> tuple[str, ...]:
        """The simulated cameras that have a cap on their lens; raises SimulatorError when there are none to ask."""
        ...

    def cover_cameras(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Cover these simulated cameras, and uncover the others; returns which are. Raises SimulatorError."""
        ...

    def shown_in_twin(self) -> str:
        """What stands before the simulated cameras, as `show_in_twin` takes it; "" for anything else. Raises
        SimulatorError when there are none to ask."""
        ...

    def show_in_twin(self, what: str) -> str:
        """Show something else, from its beginning; returns what is shown. `what`: ``hand:MOTION``, ``bare:MOTION``
        (without markers), ``board``, ``table`` (the board lies on it), ``ruler``, ``marker:METRES``, or ``empty``.
        Raises SimulatorError."""
        ...

    def save_scene(self, path: Path) -> None:
        """Write the scene of the simulated rig with what it shows now. Raises SimulatorError."""
        ...

    def give_up(self) -> None:
        """End whatever is being started, so that a cancelled start leaves nothing behind."""
        ...

    def close(self) -> str:
        """End all that the app started; a sentence about what was left running on purpose, or ""."""
        ...
