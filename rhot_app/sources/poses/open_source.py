"""Sources of poses by their names, as commands, wizards and settings write them; and where lines of poses come from: a
program's standard output, a TCP connection, UDP datagrams."""

from __future__ import annotations

import contextlib
import os
import shlex
import shutil
import socket
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path

from rhot_app.errors import SourceError
from rhot_app.sources.poses.lines import LinePoses
from rhot_app.sources.poses.source import FilePoses, PoseSource
from rhot_node.errors import printable
from rhot_node.files import KIB
from rhot_node.threads import ANSWER_S
from rhot_node.wire.messages import PORT_MAX

LIBSURVIVE: tuple[str, ...] = ("survive-cli", "--record-stdout", "1", "--record-rawlight", "0", "--record-imu", "0",
                               "--record-angle", "0")
"""Prints poses without the measurements that they were made of."""

_READ_BYTES = 64 * KIB
_READS = 16  # of one call: what comes faster than a mebibyte a call waits for the next


def why(exc: OSError | ValueError) -> str:
    """Why an address cannot be used, as a clause."""
    return getattr(exc, "strerror", None) or str(exc)


class ProgramLines:
    """The standard output of a program that is started, and ended by `close`."""

    def __init__(self, command: Sequence[str]) -> None:
        """Start it. Raises SourceError when it cannot be."""
        self.name, self._end = os.path.basename(command[0]), ""  # noqa: PTH119
        whole = shutil.which(command[0])
        if whole is None:
            raise SourceError(f"There is no program {printable(command[0])!r} in the path. Install it, or give its "
                              "whole path.")
        # C programs print into a pipe in blocks of 4 kB, unless they are told otherwise
        line_by_line = ("stdbuf", "-oL") if shutil.which("stdbuf") else ()
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed by close()
        try:
            self._process = subprocess.Popen([*line_by_line, whole, *command[1:]], stdin=subprocess.DEVNULL,
                                             stdout=subprocess.PIPE, stderr=self._errors)
        except OSError as exc:
            self._errors.close()
            raise SourceError(f"{printable(whole)}: cannot be started ({exc.strerror}).") from exc
        assert self._process.stdout is not None
        self._output = self._process.stdout
        os.set_blocking(self._output.fileno(), False)

    @property
    def end(self) -> str:
        """The exit code and the last line on standard error, once all output was read."""
        return self._end

    def read(self) -> bytes:
        """See `LineInput`."""
        parts: list[bytes] = []
        while not self._end and len(parts) < _READS:
            try:
                part = os.read(self._output.fileno(), _READ_BYTES)
            except BlockingIOError:
                break
            if not part:
                self._end = self._why_ended()
            parts.append(part)
        return b"".join(parts)

    def close(self) -> None:
        """End the program, and insist after `ANSWER_S`."""
        if self._errors.closed:
            return
        self._end = self._end or f"{self.name} was ended."
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(ANSWER_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._output.close()
        self._errors.close()

    def _why_ended(self) -> str:
        try:
            code: int | None = self._process.wait(ANSWER_S)
        except subprocess.TimeoutExpired:
            return f"{self.name} has closed its standard output. Start it again."
        self._errors.seek(max(0, self._errors.seek(0, os.SEEK_END) - 1000))
        words = self._errors.read().decode(errors="replace").strip().splitlines()
        said = f" Its last words: {printable(words[-1], 200)}" if words else ""
        return f"{self.name} has ended with code {code}.{said}"


class TcpLines:
    """A connection to a program that prints lines into it."""

    def __init__(self, host: str, port: int) -> None:
        """Connect. Raises SourceError when nobody answers in three seconds."""
        self.name, self.end = f"tcp:{host}:{port}", ""
        try:
            self._socket = socket.create_connection((host, port), ANSWER_S)
        except (OSError, ValueError) as exc:  # ValueError: a name that no host can have
            raise SourceError(f"{printable(self.name)}: nobody answers ({why(exc)}). Start the program that serves "
                              "poses there.") from exc
        self._socket.setblocking(False)

    def read(self) -> bytes:
        """See `LineInput`."""
        parts: list[bytes] = []
        with contextlib.suppress(BlockingIOError):
            while not self.end and len(parts) < _READS:
                try:
                    part = self._socket.recv(_READ_BYTES)
                except ConnectionError:
                    part = b""
                if not part:
                    self.end = f"{self.name}: the connection was closed. Start the program that serves poses again."
                parts.append(part)
        return b"".join(parts)

    def close(self) -> None:
        """See `LineInput`."""
        self._socket.close()
        self.end = self.end or f"{self.name} was closed."


class UdpLines:
    """Datagrams of whole lines, at an address of this machine."""

    end = ""

    def __init__(self, host: str, port: int) -> None:
        """Listen. Raises SourceError when the port is taken."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((host, port))
        except (OSError, ValueError) as exc:
            self._socket.close()
            raise SourceError(f"udp:{printable(host)}:{port}: cannot be listened on ({why(exc)}). Choose another "
                              "port, or end the program that has it.") from exc
        self.port = int(self._socket.getsockname()[1])
        self.name = f"udp:{host}:{self.port}"
        self._socket.setblocking(False)

    def read(self) -> bytes:
        """See `LineInput`."""
        parts: list[bytes] = []
        with contextlib.suppress(BlockingIOError):
            while len(parts) < _READS * 16:
                parts.append(self._socket.recv(_READ_BYTES).rstrip(b"\n") + b"\n")
        return b"".join(parts)

    def close(self) -> None:
        """See `LineInput`."""
        self._socket.close()


def command_of(text: str) -> list[str]:
    """The words of a command line. Raises SourceError when it is none."""
    try:
        words = shlex.split(text)
    except ValueError as exc:
        raise SourceError(f"{printable(text)!r} is no command line ({exc}).") from exc
    if not words:
        raise SourceError("The program that prints poses is missing. Write run:PROGRAM and its arguments.")
    return words


def endpoint_of(text: str, host: str) -> tuple[str, int]:
    """Host and port of ``HOST:PORT`` or ``PORT``; `host` where none is named. Raises SourceError."""
    named, _, port = text.rpartition(":")
    if not port.isdecimal() or not 1 <= int(port) <= PORT_MAX:
        raise SourceError(f"{printable(text)!r} is no address. Write HOST:PORT or PORT, a port from 1 to {PORT_MAX}.")
    return named or host, int(port)


LOOPBACK = "127.0.0.1"


def open_source(name: str, tracker: str = "") -> PoseSource:
    """The source `name`: ``openvr``, ``libsurvive``, ``run:PROGRAM ...``, ``tcp:HOST:PORT``, ``udp:PORT`` (of this
    machine only; ``udp:ADDRESS:PORT`` listens at that address), or a CSV file. `tracker`: serial number, name or role.

    Raises SourceError, or ObjectError for a file.
    """
    kind, colon, rest = name.partition(":")
    if name == "openvr":
        from rhot_app.sources.poses.steamvr import SteamVrPoses

        return SteamVrPoses(tracker)
    if name == "libsurvive":
        return LinePoses(ProgramLines(LIBSURVIVE), tracker)
    if colon and kind == "run":
        return LinePoses(ProgramLines(command_of(rest)), tracker)
    if colon and kind == "tcp":
        return LinePoses(TcpLines(*endpoint_of(rest, LOOPBACK)), tracker)
    if colon and kind == "udp":
        return LinePoses(UdpLines(*endpoint_of(rest, LOOPBACK)), tracker)
    if tracker:
        raise SourceError(f"{name}: a CSV file holds one tracker, without its name. Leave --tracker out.")
    return FilePoses(Path(name))
