"""Film, play, score: an evaluation from a scene to its figures, for the command and for benchmarks."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from rhot_app.evaluation.report import figures_of
from rhot_app.evaluation.run import evaluation_run
from rhot_app.progress import ProgressLine
from rhot_app.simulator.nodes.film import film
from rhot_app.simulator.nodes.shot import make_shot, read_shot
from rhot_app.simulator.scene.scene import Scene

Detector = Literal["fast", "reference"]


def evaluate(scene: Scene, motion: str, seconds: float, work: Path, *, loss: float = 0.0,
             detector: Detector = "fast") -> dict[str, Any]:
    """Figures of a motion filmed in `scene`; `work` is an empty folder. Raises RhotError."""
    shot = make_shot(scene, motion, seconds)
    line = ProgressLine(f"rendering {seconds:g} s of {shot.scene_object.name}")
    film(shot, work / "frames", line)
    line.finish()
    return evaluate_frames(work / "frames", work, loss=loss, detector=detector)


def evaluate_frames(frames: Path, work: Path, *, loss: float = 0.0, detector: Detector = "fast") -> dict[str, Any]:
    """Figures of the shot in folder `frames`, played in real time. Raises RhotError."""
    shot, scene = read_shot(frames)
    line = ProgressLine(f"playing {shot.seconds:g} s of {shot.motion}")
    place = work / "run"
    place.mkdir()
    trial = evaluation_run(frames, scene, shot.seconds, place, loss=loss, detector=detector, progress=line)
    line.finish()
    return {"motion": shot.motion, "seconds": shot.seconds, "seed": shot.seed, "preset": scene.settings.preset,
            "distance_m": scene.settings.distance_m, "loss": loss, "detector": detector,
            **figures_of(trial, frames)}
