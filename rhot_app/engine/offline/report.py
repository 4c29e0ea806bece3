"""What a fault report holds: versions, rig, status, the nodes' own words, the engine's log, the last minute of a log.

No keys: the files that hold them are never read, public keys of a rig are replaced by their SHA-256, and whatever looks
like a key or a pairing code is taken out of all text.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import platform
import re
import sys
import zipfile
from collections import deque
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Final

import msgspec

from rhot_app.engine.client import EngineClient
from rhot_app.engine.directory import EngineDirectory, default_directory
from rhot_app.errors import EngineError
from rhot_app.project import Rig
from rhot_app.recording.raw_log import LogReader, Record, RecordKind, encode_log
from rhot_node.files import open_input
from rhot_node.network.pairing import ALPHABET
from rhot_node.terminal import before

LAST_S: Final = 60.0
LOG_BYTES_MAX: Final = 1 << 20

_CLOCK_S = 2.0  # of clock exchanges before the first datagram: as much as a recording begins with
_RECORDS_MAX = 500_000
_SESSIONS_MAX = 64  # starts and stops before the last minute
_PACKAGES = ("rhot", "numpy", "numba", "opencv-python-headless", "msgspec", "pyzmq", "scipy", "PySide6-Essentials",
             "pyqtgraph", "PyOpenGL", "zeroconf", "platformdirs", "ai-edge-litert")
_NODE_REQUESTS = ("state", "counters", "settings")
_SECRETS = (
    (re.compile(r"[0-9a-fA-F]{32,}"), "[hexadecimal digits]"),
    (re.compile(rf"\b[{ALPHABET}]{{5}}-[{ALPHABET}]{{5}}-[{ALPHABET}]{{5}}\b|\b[{ALPHABET}]{{15}}\b"), "[code]"),
)


class Report:
    """Collects the files of one report; what cannot be had becomes a note."""

    def __init__(self) -> None:
        self.notes: list[str] = []
        self._files: dict[str, bytes] = {}

    @property
    def names(self) -> list[str]:
        """The files so far."""
        return list(self._files)

    def add_versions(self) -> None:
        """Programs, packages and machine."""
        self._add_json("versions.json", {
            "packages": package_versions(), "python": sys.version,
            "system": platform.platform(), "machine": platform.machine(), "processors": os.cpu_count(),
            "load": os.getloadavg()})

    def add_engine(self, directory: Path | None) -> Path | None:
        """Rig, status, nodes and log file of the engine that runs there; returns the log that it records, if any."""
        place = EngineDirectory((directory or default_directory()).absolute())
        for log in (place.log_file, place.twin_log_file):
            for path in (log, before(log)):
                with contextlib.suppress(OSError):
                    self._add_text(path.name, _tail(path))
        with EngineClient(place.path, states=False, events=False) as client:
            try:
                status = client.command("status")["status"]
                rig = client.rig()
            except (EngineError, msgspec.ValidationError) as exc:
                self.notes.append(f"rig, status and nodes of the engine ({exc})")
                return None
            self._add_json("status.json", status)
            self.add_rig(rig)
            self._add_json("nodes.json", {node.name: _asked(client, node.node_id) for node in rig.nodes})
        recorded = status.get("log_path")
        return Path(recorded) if recorded else None

    def add_rig(self, rig: Rig) -> None:
        """The rig, its nodes' public keys replaced by their SHA-256."""
        self._files["rig.json"] = msgspec.json.format(msgspec.json.encode(without_keys(rig)), indent=2)

    def add_log(self, path: Path) -> None:
        """The last minute of a raw log, as a log that can be replayed. Raises RecordingError."""
        with contextlib.closing(LogReader(path)) as reader:
            records = last_part(reader, LAST_S)
            rig = without_keys(reader.rig)
            about = {**reader.about, "losses": msgspec.to_builtins(reader.losses)}
        self._files["last_minute.log"] = b"".join(encode_log(rig, json.loads(_scrubbed(json.dumps(about))), records))
        if "rig.json" not in self._files:
            self.add_rig(reader.rig)

    def to_zip(self) -> bytes:
        """The bytes of the zip file."""
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in self._files.items():
                archive.writestr(name, data)
        return buffer.getvalue()

    def _add_json(self, name: str, document: Any) -> None:
        self._add_text(name, json.dumps(document, indent=2, default=str))

    def _add_text(self, name: str, text: str) -> None:
        self._files[name] = _scrubbed(text).encode(errors="replace")


def without_keys(rig: Rig) -> Rig:
    """The rig with another key in the place of each node's, told apart as before."""
    nodes = tuple(msgspec.structs.replace(node, public_key=hashlib.sha256(node.public_key.encode()).hexdigest())
                  if node.public_key else node for node in rig.nodes)
    return msgspec.structs.replace(rig, nodes=nodes)


def last_part(records: Iterable[Record], seconds: float) -> list[Record]:
    """The end of a log with what a replay needs to know of the time before: sessions and clock exchanges."""
    bookmarks: list[Record] = []  # which stand anywhere
    before: deque[Record] = deque(maxlen=_SESSIONS_MAX)
    kept: deque[Record] = deque(maxlen=_RECORDS_MAX)
    newest_ns = -(1 << 63)
    for record in records:
        if record.kind is RecordKind.BOOKMARK:
            bookmarks.append(record)
            continue
        newest_ns = max(newest_ns, record.t_master_ns)
        kept.append(record)
        while kept and kept[0].t_master_ns < newest_ns - round(1e9 * (seconds + _CLOCK_S)):
            oldest = kept.popleft()
            if oldest.kind in (RecordKind.START, RecordKind.STOP):
                before.append(oldest)
    since_ns = newest_ns - round(1e9 * seconds)
    return [*before, *(record for record in kept
                       if record.kind is not RecordKind.DATAGRAM or record.t_master_ns >= since_ns), *bookmarks]


def _asked(client: EngineClient, node_id: int) -> dict[str, Any]:
    """What the node says of itself, its doctor's checks (`health`) included, or why it says nothing."""
    found: dict[str, Any] = {}
    for request in _NODE_REQUESTS:
        try:
            found[request] = client.command("node", node_id=node_id, request={"request": request})["answer"]
        except EngineError as exc:
            return {**found, "error": str(exc)}
    return found


def _scrubbed(text: str) -> str:
    for pattern, instead in _SECRETS:
        text = pattern.sub(instead, text)
    return text


def _tail(path: Path) -> str:
    with open_input(path) as file:
        size = file.seek(0, 2)
        file.seek(max(0, size - LOG_BYTES_MAX))
        return file.read(LOG_BYTES_MAX).decode(errors="replace")


def package_versions() -> dict[str, str]:
    """RHOT and the packages whose versions explain faults."""
    return {name: _version(name) for name in _PACKAGES}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
