"""The engine's private directory: where its sockets and its lock stand, and who may look into it."""

from __future__ import annotations

import fcntl
import os
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from rhot_app.errors import EngineError

LONGEST_SOCKET_PATH = 107  # sun_path of a Unix socket, less its closing zero
_LONGEST_NAME = len("/commands.ipc")


def default_directory() -> Path:
    """``$XDG_RUNTIME_DIR/rhot``, or ``/tmp/rhot-UID`` where the system has no runtime directory."""
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    return Path(runtime, "rhot") if runtime else Path(f"/tmp/rhot-{os.getuid()}")


@dataclass(frozen=True, slots=True)
class EngineDirectory:
    """Paths inside one engine's directory. Raises EngineError for a path that no socket can have."""

    path: Path

    def __post_init__(self) -> None:
        try:
            length = len(str(self.path.absolute()).encode())
        except UnicodeEncodeError as exc:
            raise EngineError(f"{self.path}: this path is not UTF-8, as a socket's must be; choose another "
                              "--directory.") from exc
        if length + _LONGEST_NAME > LONGEST_SOCKET_PATH:
            raise EngineError(f"{self.path}: this path is too long for a socket; choose a shorter --directory.")

    @property
    def states(self) -> str:
        """ZeroMQ endpoint of the hand states (PUB)."""
        return f"ipc://{self.path}/states.ipc"

    @property
    def events(self) -> str:
        """ZeroMQ endpoint of status and previews (PUB)."""
        return f"ipc://{self.path}/events.ipc"

    @property
    def commands(self) -> str:
        """ZeroMQ endpoint of the commands (the client asks with REQ)."""
        return f"ipc://{self.path}/commands.ipc"

    @property
    def lock_file(self) -> Path:
        """Held by the running engine."""
        return self.path / "engine.lock"

    @property
    def log_file(self) -> Path:
        """What an engine started in the background said."""
        return self.path / "engine.log"

    @property
    def twin_log_file(self) -> Path:
        """What simulated nodes started in the background said."""
        return self.path / "twin.log"

    @property
    def cameras_log_file(self) -> Path:
        """What the process of this computer's cameras said."""
        return self.path / "cameras.log"

    @property
    def activity_file(self) -> Path:
        """What the engine does, see `rhot_app.engine.activity`."""
        return self.path / "engine.json"

    @property
    def session_file(self) -> Path:
        """Processes that an app has started, see `rhot_app.engine.process`."""
        return self.path / "session.json"


def open_directory(path: Path | None = None) -> EngineDirectory:
    """Create the directory with mode 0700 if it is missing, and check that nobody else can reach into it.

    Raises EngineError when it belongs to somebody else, is open to others, is a link, or has too long a path.
    """
    place = (path or default_directory()).absolute()
    directory = EngineDirectory(place)
    try:
        place.mkdir(mode=0o700, parents=True, exist_ok=True)
        info = place.lstat()
    except OSError as exc:
        raise EngineError(f"{place}: cannot be made ({exc.strerror}); choose another --directory.") from exc
    if not stat.S_ISDIR(info.st_mode):
        raise EngineError(f"{place}: is not a directory (a link is not followed); choose another --directory.")
    if info.st_uid != os.getuid():
        raise EngineError(f"{place}: belongs to user {info.st_uid}, not to you; choose another --directory.")
    if info.st_mode & 0o077:
        raise EngineError(f"{place}: is open to other users (mode {info.st_mode & 0o777:o}); "
                          f"run `chmod 700 {place}` or choose another --directory.")
    return directory


class EngineLock:
    """The lock that one engine holds on its directory. The kernel drops it when the process dies, however it dies."""

    def __init__(self, directory: EngineDirectory) -> None:
        """Take the lock; raises EngineError naming the engine that holds it."""
        self._file: BinaryIO = directory.lock_file.open("a+b")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as exc:
            self._file.close()
            raise EngineError(f"{directory.path}: an engine is running here already (pid {lock_holder(directory)}); "
                              "stop it, or choose another --directory.") from exc
        self._file.truncate(0)
        self._file.write(str(os.getpid()).encode())
        self._file.flush()

    def release(self) -> None:
        """Give the lock back. May be called twice."""
        self._file.close()


def lock_holder(directory: EngineDirectory) -> int | None:
    """Process id of the engine that holds the directory's lock; None when none does."""
    try:
        with directory.lock_file.open("rb") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except OSError:
                text = file.read(20)
                return int(text) if text.isdigit() else None
    except OSError:
        return None
    return None
