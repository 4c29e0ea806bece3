"""What the certificate is made of: raw logs, what the operator states about each, and the arrays that they hold.

A folder of recordings has ``protocol.json``, which names its logs. Whatever made them - a terminal, the wizard, the
simulated rig - the same file leads to the same certificate.
"""

from __future__ import annotations

import contextlib
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from rhot_app.errors import CertificateError, RecordingError
from rhot_app.latency import latency_row
from rhot_app.progress import Progress, silent
from rhot_app.project import Rig, with_tracker
from rhot_app.recording.raw_log import LogReader
from rhot_app.sources.replay import LogValidator
from rhot_app.state import LATENCY_STAGES
from rhot_app.tracking.locate import locate_paired, rig_table
from rhot_app.tracking.pairing import Paired, Pairing
from rhot_app.tracking.rig_arrays import compile_rig
from rhot_app.tracking.tracker import CameraObservations
from rhot_node.files import read_document, write_document

Array = NDArray[np.float64]
Times = NDArray[np.int64]

FORMAT: Final = "rhot-protocol"
VERSION: Final = 1
PROTOCOL_NAME: Final = "protocol.json"

READING_SD_M: Final = 0.5e-3
"""Standard deviation of a length read off a ruler with millimetre marks, or of a mark set by hand: half a mark."""

WARM_STATES: Final = 30
"""What a replay computes first it computes with cold caches; an engine has run for minutes."""

LogName = Annotated[str, Meta(min_length=1, max_length=255)]
Length = Annotated[float, Meta(gt=0, le=10_000)]
MarkerName = Annotated[str, Meta(min_length=1, max_length=32)]


class StaticStep(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A still hand or board. `facing`: which side of the hand is towards the cameras; null where it is no hand."""

    log: LogName
    facing: Literal["palm", "back"] | None = None


class RulerStep(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`marker` held still at `distance_mm` by a ruler, from the line between the lenses straight ahead."""

    log: LogName
    distance_mm: Length
    marker: MarkerName


class RodStep(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A rod with two markers, `length_mm` from centre to centre, moved slowly through the volume."""

    log: LogName
    length_mm: Length
    markers: tuple[MarkerName, MarkerName]


class FlashStep(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A patch of a screen that shows and hides the colour of `marker`. `edges`: master monotonic time, ns, at which the
    screen was ordered to change, and whether the patch is lit from then on."""

    log: LogName
    marker: MarkerName
    edges: tuple[tuple[int, bool], ...]


class PlumbStep(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A rod that hangs still from a string; `upper` and `lower` are its markers."""

    log: LogName
    upper: MarkerName
    lower: MarkerName


class ProtocolFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """``protocol.json``: what was recorded, and what the operator states. Logs stand beside the file, or are absolute.
    A step that is null or empty was not done."""

    static: StaticStep | None = None
    ruler: tuple[RulerStep, ...] = ()
    rod: RodStep | None = None
    flash: FlashStep | None = None
    plumb: PlumbStep | None = None
    simulated: bool = False
    format: Literal["rhot-protocol"] = FORMAT
    version: Literal[1] = VERSION


def read_protocol(folder: Path) -> ProtocolFile:
    """The statements of a folder of recordings. Raises CertificateError."""
    if not folder.is_dir():
        raise CertificateError(f"{folder}: there is no such folder; name the one with {PROTOCOL_NAME} and its logs.")
    return read_document(folder / PROTOCOL_NAME, ProtocolFile, format_name=FORMAT, version=VERSION,
                         error=CertificateError)


def write_protocol(folder: Path, protocol: ProtocolFile) -> None:
    """Write them into the folder, whole or not at all. Raises CertificateError."""
    try:
        write_document(folder / PROTOCOL_NAME, protocol)
    except OSError as exc:
        raise CertificateError(f"{folder / PROTOCOL_NAME}: cannot be written ({exc.strerror}).") from exc


def copy_protocol(folder: Path, protocol: ProtocolFile, into: Path) -> None:
    """Copy the logs of a protocol that stand in `folder` into the new folder `into`, with a ``protocol.json`` that
    names them there. Raises OSError, CertificateError."""
    into.mkdir()

    def copied(step: str, log: str) -> str:
        name = f"{step}.rhotlog"
        shutil.copyfile(folder / log, into / name)
        return name

    moved = {name: msgspec.structs.replace(step, log=copied(name, step.log))
             for name in ("static", "rod", "flash", "plumb") if (step := getattr(protocol, name)) is not None}
    ruler = tuple(msgspec.structs.replace(step, log=copied(f"ruler_{k:02d}_{step.distance_mm:.0f}mm", step.log))
                  for k, step in enumerate(protocol.ruler, start=1))
    write_protocol(into, msgspec.structs.replace(protocol, ruler=ruler, **moved))


@dataclass(frozen=True, slots=True)
class CertifiedRecording:
    """One log through a rig. T instants that all cameras bracket, F frames in the order of arrival; C cameras, M
    markers in the rig's order.

    `times_s` (T,) s and `positions` (T, M, 3) m, rig frame, triangulated and unfiltered, NaN where not located.
    `cameras` (F,) index; `arrivals_ns` (F,) received by the master; `exposed_ns` (F, M) master time of the marker's own
    row, of the picture's middle row where it is lost; `pixels` (F, M, 2) px, NaN where lost;
    `clock_bound_s`: the most that a node's clock may be off.
    """

    marker_ids: tuple[str, ...]
    times_s: Array
    positions: Array
    cameras: NDArray[np.int64]
    arrivals_ns: Times
    exposed_ns: Times
    pixels: Array
    camera_count: int
    clock_bound_s: float

    def marker(self, name: str) -> int:
        """Its index. Raises CertificateError."""
        if name not in self.marker_ids:
            raise CertificateError(f"the rig has no marker {name!r}; it has {', '.join(self.marker_ids)}.")
        return self.marker_ids.index(name)


def read_recording(path: Path, rig: Rig, progress: Progress = silent) -> CertifiedRecording:
    """A log located by `rig`, whatever rig it was recorded with. No hand is assumed: a rod or a board is none.

    Raises CertificateError when it is no log or holds no frame of the rig's.
    """
    frames, paired = _frames(path, rig, progress)
    if not frames:
        raise CertificateError(f"{path}: no frame in it can be used with the rig {rig.name!r}. Give the rig that it "
                               "was recorded with, or record again.")
    table = rig_table(compile_rig(rig))
    times = np.array([one.t_ns for one in paired], dtype=np.int64)
    positions: Array = np.full((len(paired), len(rig.markers.ids), 3), np.nan)
    for row, one in enumerate(paired):
        positions[row] = locate_paired(one, table)[0].positions
    frames.sort(key=lambda frame: frame.t_receive_ns)
    cameras = np.array([frame.camera for frame in frames])
    pixels = np.array([frame.pixels for frame in frames])
    middles: Array = np.array([0.5 * node.intrinsics.height for node in rig.nodes])[cameras]
    rows = np.where(np.isfinite(pixels[:, :, 1]), pixels[:, :, 1], middles[:, None])
    row0 = np.array([frame.t_row0_master_ns for frame in frames], dtype=np.int64)
    row_time = np.array([frame.row_time_ns for frame in frames])
    return CertifiedRecording(
        rig.markers.ids, np.asarray(1e-9 * (times - times[:1]), dtype=np.float64), positions, cameras,
        np.array([frame.t_receive_ns for frame in frames], dtype=np.int64),
        row0[:, None] + np.round(rows * row_time[:, None]).astype(np.int64), pixels, len(rig.nodes),
        max(frame.clock_bound_s for frame in frames))


def _frames(path: Path, rig: Rig, progress: Progress) -> tuple[list[CameraObservations], list[Paired]]:
    """Every frame that is let in, and every instant that all cameras bracket."""
    pairing = Pairing(len(rig.nodes), len(rig.markers.ids))
    frames, paired = [], []
    try:
        with contextlib.closing(LogReader(path)) as reader:
            validator = LogValidator(rig)
            changes, size = validator.changes, max(path.stat().st_size, 1)
            for number, record in enumerate(reader):
                if number % 512 == 0:
                    progress(f"reading {path.name}", min(1.0, 400.0 * number / size))
                frame = validator.feed(record)
                if not isinstance(frame, CameraObservations):
                    continue
                if validator.changes != changes:
                    changes = validator.changes
                    pairing.reset()
                frames.append(frame)
                pairing.ingest(frame)
                due = pairing.due()
                if due is not None:
                    paired.append(due)
    except RecordingError as exc:
        raise CertificateError(str(exc)) from exc
    return frames, paired


@dataclass(frozen=True, slots=True)
class Latencies:
    """N states of a log. `seconds` (N, stages) of `LATENCY_STAGES`, NaN for one that a replay does not have:
    detection and network are as recorded, the others this computer's, now. `waits` (N,) s: from the instant that the
    state describes to the arrival of the datagram that completed it."""

    seconds: Array
    waits: Array

    @property
    def compute_s(self) -> float:
        """The tracker's own median time, s."""
        own = [LATENCY_STAGES.index(name) for name in ("pair", "triangulate", "filter", "solve")]
        return float(np.nansum(np.nanmedian(self.seconds[:, own], axis=0)))


def read_latencies(path: Path, rig: Rig) -> Latencies:
    """Where the time goes in the states that the classic tracker makes of a log.

    Raises CertificateError when it makes no state.
    """
    from rhot_app.evaluation.track import states_of

    rig = rig if rig.tracker.kind == "classic" else with_tracker(rig, "classic")
    try:
        with contextlib.closing(LogReader(path)) as reader:
            rows = [[*latency_row(state), 1e-9 * (state.t_receive_ns - state.t_master_ns)]
                    for state in states_of(reader, rig)]
    except RecordingError as exc:
        raise CertificateError(str(exc)) from exc
    rows = rows[min(len(rows) // 4, WARM_STATES):]
    if not rows:
        raise CertificateError(f"{path}: the tracker makes no state of it; record again while all nodes stream.")
    table = np.array(rows)
    return Latencies(table[:, :-1], table[:, -1])
