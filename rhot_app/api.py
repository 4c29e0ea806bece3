"""RHOT from Python: recordings as arrays, live states, calibration and export. docs/api.md has examples.

This interface stays the same between versions; the packages that it uses may change.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.calibration.board.boards import AprilGrid, Board, CharucoBoard, Chessboard, CircleGrid
from rhot_app.calibration.stereo.result import StereoResult
from rhot_app.engine.client import EngineClient
from rhot_app.errors import CalibrationError, EngineError, ExportError, RecordingError, RhotError, RigError
from rhot_app.export.export import Exported, export_log
from rhot_app.export.frames import Frame
from rhot_app.export.plan import ExportOptions, Hand, Tracker, Units
from rhot_app.export.recording import TrackedLog, read_log
from rhot_app.export.resample import Resampler, checked_rate
from rhot_app.export.states import HandStates, ObjectStates, joined
from rhot_app.hand.skeleton import ANGLES, FINGERS, JOINTS
from rhot_app.objects.object_file import ObjectModel, load_object, save_object
from rhot_app.objects.state import ObjectState, Validity
from rhot_app.progress import Progress, silent
from rhot_app.project import Rig, save_rig
from rhot_app.project import load_rig as _load_rig
from rhot_app.state import Condition, HandState, Knowledge
from rhot_app.tracking.extrapolation import Extrapolator
from rhot_node.compiled import announce_compilation

if TYPE_CHECKING:
    import pandas

__all__ = [
    "ANGLES", "FINGERS", "JOINTS", "AprilGrid", "CalibrationError", "CharucoBoard", "Chessboard", "CircleGrid",
    "Condition", "EngineClient", "EngineError", "ExportError", "Exported", "Extrapolator", "HandState", "HandStates",
    "Knowledge", "ObjectModel", "ObjectState", "ObjectStates", "Recording", "RecordingError", "RhotError", "Rig",
    "RigError", "StereoCalibration", "Validity", "calibrate_stereo", "export", "live", "load_object", "load_rig",
    "open_recording", "save_object", "save_rig",
]

announce_compilation()  # a program that imports this waits for minutes, once, and its user would not know why

PATIENCE_S = 5.0
"""An engine publishes its status ten times a second; after this long without a message there is none."""


@dataclass(slots=True)
class Recording:
    """A raw log on disk. `rig`: what it is tracked with. `losses`: sentences about what the last pass could not read of
    it; empty when all was read."""

    path: Path
    rig: Rig
    created: str  # UTC, as the log says itself
    losses: tuple[str, ...] = ()

    def states(self, tracker: Tracker | None = None, *, rate_hz: float | None = None, smooth: bool = False,
               progress: Progress = silent) -> HandStates:
        """Track the whole log: what an engine would have published. `tracker` None is the rig's own.

        `rate_hz` gives states at equal intervals instead of their own times. `smooth`: every state uses
        the whole recording, not only what came before it; the estimator alone can.

        Raises RecordingError when nothing can be tracked, RigError when the rig does not suit the tracker, ExportError
        when the tracker does not smooth, or a pause is too long for a rate.
        """
        rate = None if rate_hz is None else checked_rate(rate_hz)
        with TrackedLog(self.path, self.rig, tracker, progress, smooth=smooth) as tracked:
            states = joined(list(tracked.blocks()))
            self.losses = tuple(tracked.losses)
            if rate is not None:
                states = joined(list(Resampler(rate, 1.0 / (tracked.camera_rate_hz or rate)).take(states)))
        return states

    def to_dataframe(self, tracker: Tracker | None = None, *, rate_hz: float | None = None,
                     units: Units = "mm", smooth: bool = False) -> pandas.DataFrame:
        """Track the whole log into a table with one row per state; columns as of a CSV export (docs/export.md).

        Raises as `states` does, and ExportError when pandas is not installed (the extra `export` has it).
        """
        return self.states(tracker, rate_hz=rate_hz, smooth=smooth).to_dataframe(units=units)

    def export(self, out: str | Path, *, format: str | None = None, tracker: Tracker | None = None,
               rate_hz: float | None = None, frame: Frame = "rig", units: Units | None = None, hand: Hand = "hand",
               smooth: bool = False, fill_s: float | None = None, again: bool = False,
               progress: Progress = silent) -> Exported:
        """Write the tracked log as a file for other programs; see `export`."""
        done = export(self.path, out, rig=self.rig, format=format, tracker=tracker, rate_hz=rate_hz, frame=frame,
                      units=units, hand=hand, smooth=smooth, fill_s=fill_s, again=again, progress=progress)
        self.losses = done.losses
        return done


def open_recording(path: str | Path, rig: Rig | str | Path | None = None) -> Recording:
    """A raw log, to be tracked with the rig it was recorded with, or with another one (`rig`, or its file).

    Raises RecordingError when `path` is no log, RigError when `rig` is no rig file.
    """
    found, created = read_log(Path(path), Path(rig) if isinstance(rig, str) else rig)
    return Recording(Path(path), found, created)


def export(log: str | Path, out: str | Path, *, rig: Rig | None = None, format: str | None = None,
           tracker: Tracker | None = None, rate_hz: float | None = None, frame: Frame = "rig",
           units: Units | None = None, hand: Hand = "hand", smooth: bool = False, fill_s: float | None = None,
           again: bool = False, progress: Progress = silent) -> Exported:
    """Track a raw log and write it in a format of `rhot_app.export.formats`: `format`, or the ending of `out`.

    The other arguments are those of ``rhot export`` (docs/export.md). `out` appears only when it is whole; an existing
    file is written over only `again`. Raises ExportError, RecordingError or RigError.
    """
    return export_log(Path(log), Path(out), format_name=format, rig=rig, again=again, progress=progress,
                      options=ExportOptions(tracker, rate_hz, frame, units, hand, smooth, fill_s))


def load_rig(path: str | Path) -> Rig:
    """A rig file (docs/rig.md). Raises RigError that names the file and the field."""
    return _load_rig(Path(path))


def live(directory: str | Path | None = None, *, patience_s: float = PATIENCE_S) -> Iterator[HandState]:
    """The states of a running engine as they come, without end; `directory` is where the engine serves its clients.

    An engine that tracks nothing is waited for. Raises EngineError when none is heard for `patience_s`. For commands
    and status, use `EngineClient`, on which this rests.
    """
    with EngineClient(None if directory is None else Path(directory)) as client:
        heard = time.monotonic()
        while True:
            messages = client.poll(0.1)
            now = time.monotonic()
            heard = now if messages else heard
            if now - heard > patience_s:
                raise EngineError(f"no engine is heard in {client.directory.path}. Start it with "
                                  "`rhot engine --rig FILE --start`.")
            yield from (message for message in messages if isinstance(message, HandState))


@dataclass(frozen=True, slots=True)
class StereoCalibration:
    """What came of a stereo calibration. `rig`: with the new lenses and places, None when there is no result or it must
    not be used; `report` has the figures, `report.verdict` and `summary` say how good it is."""

    report: StereoResult
    rig: Rig | None

    @property
    def summary(self) -> str:
        """The result in a sentence."""
        return self.report.summary


def calibrate_stereo(pictures: Mapping[str, Sequence[str | Path]], board: Board, rig: Rig, *,
                     intrinsics: Mapping[str, str | Path] | None = None, baseline_m: float | None = None,
                     progress: Progress = silent) -> StereoCalibration:
    """Put two or more cameras together from pictures of a board that they took at the same moments.

    `pictures`: files by the camera's name in `rig`; those of one moment have the same number in their names. `board`:
    `Chessboard(cols, rows, square_m)`, `CharucoBoard`, `AprilGrid` or `CircleGrid`. `intrinsics`: files of calibrated
    lenses by camera; others are found from the same pictures. `baseline_m`: the distance of the first two cameras as
    measured by hand. Only this length shows a wrong size of the squares. Nothing is written: `save_rig` does that.

    Raises CalibrationError when the pictures cannot be put together. The command is ``rhot calibrate stereo``.
    """
    from rhot_app.calibration.lens.fit import find_lens
    from rhot_app.calibration.lens.intrinsics import load_intrinsics
    from rhot_app.calibration.stereo.calibrate import (
        KnownLengths,
        calibrate,
        calibrated_rig,
        lens_of,
        require_nodes,
        rig_verdict,
    )
    from rhot_app.calibration.stereo.reading import read_shared

    names = list(pictures)
    require_nodes(rig, names)
    read = read_shared({name: [Path(path) for path in paths] for name, paths in pictures.items()}, board,
                       progress=progress)
    given = {name: load_intrinsics(Path(path)).lens for name, path in (intrinsics or {}).items()}
    lenses = [given[name] if name in given else find_lens(read.views.of_camera(camera), board, name)
              for camera, name in enumerate(names)]
    nodes = {node.name: node for node in rig.nodes}
    report = calibrate(
        read.views, lenses, known=KnownLengths(baseline_m=baseline_m), dropped=read.dropped,
        remembered=[None if nodes[name].intrinsics.nominal else lens_of(nodes[name]) for name in names],
        noticed=[] if read.size is None else [read.size], progress=progress)
    if report.figures is None:
        return StereoCalibration(report, None)
    made = calibrated_rig(rig, report.figures)
    return StereoCalibration(report, made if rig_verdict(report, made).acceptable else None)
