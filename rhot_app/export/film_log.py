"""Films of a bare hand as a raw log that the app replays beside their pictures; for a process that has time for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rhot_app.errors import RecordingError
from rhot_app.progress import Progress, silent
from rhot_app.project import Intrinsics, load_rig
from rhot_app.sources.frame_sets import on_one_clock, open_videos
from rhot_app.sources.recorded_pictures import recorded_pictures


@dataclass(frozen=True, slots=True)
class ChosenFilm:
    """A film of a camera, and by how much later than the others' its time begins, s."""

    camera: str
    path: Path
    offset_s: float = 0.0


def describe_film(path: Path) -> str:
    """What a film is, e.g. "640 x 480 px, 30 images/s, 12.0 s". Raises RecordingError when it is none."""
    source = recorded_pictures(path)
    size = f"{source.size[0]} x {source.size[1]} px"
    if source.files:
        return f"{size}, {source.count} picture{'s' if source.count > 1 else ''}"
    if source.fps > 0.0 and source.count:
        return f"{size}, {source.fps:.4g} images/s, {source.count / source.fps:.1f} s"
    return size


def log_films(rig_file: Path | None, films: Sequence[ChosenFilm], log: Path, *,
              progress: Progress = silent) -> list[str]:
    """Track the films' hand by landmarks and write what was found as `log`, with the measured bones; sentences on what
    came of it. An existing log is written over.

    `rig_file` None: one film, whose lens is assumed. Raises KeypointError without networks, RecordingError, ExportError
    or RigError.
    """
    # numerical code, for which no window should wait
    from rhot_app.export.landmark_track import (
        LandmarkRun,
        assumed_rig,
        landmark_rig_of,
        landmark_sentences,
        track_landmarks,
    )
    from rhot_node.landmarks.networks import open_hand_networks

    open_hand_networks()  # without them nothing is begun
    said = []
    if rig_file is None:
        rig = assumed_rig([str(film.path) for film in films])
        films = [ChosenFilm(rig.nodes[0].name, films[0].path)]
        said.append(f"The lens is assumed to see {Intrinsics.ASSUMED_DEG:.0f} degrees across: distances are a guess.")
    else:
        rig = load_rig(rig_file)
        strange = next((film for film in films if film.camera not in {node.name for node in rig.nodes}), None)
        if strange is not None:
            raise RecordingError(f"{rig_file}: it has no camera {strange.camera!r}; choose another for {strange.path}.")
    rig = landmark_rig_of(rig, tuple(film.camera for film in films))
    videos = on_one_clock(open_videos(rig, {film.camera: str(film.path) for film in films}, None),
                          {film.camera: film.offset_s for film in films})
    summary = track_landmarks(rig, videos, LandmarkRun(either_side=rig_file is None, kept=log, again=True), progress)
    return [*said, *landmark_sentences(summary.document() | {"out": None, "overlay": None, "log": str(log),
                                                    "hand_file": None})]
