"""Trackers side by side: the same takes through each of them, the figures of every run and of all seeds together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from rhot_app.evaluation.accuracy import Figures, accuracy, pooled
from rhot_app.evaluation.deviations import deviations, worn_by
from rhot_app.evaluation.report import SETTLE_S
from rhot_app.evaluation.takes import Order, Take, Told, take
from rhot_app.evaluation.track import rig_with, tracked
from rhot_app.project import TrackerSettings
from rhot_app.simulator.scene import Scene, make_scene

MOTIONS = ("rest", "wave", "grasp", "pinch", "fast")
TRACKERS = {"classic": TrackerSettings(kind="classic"), "model": TrackerSettings(kind="model")}


@dataclass(frozen=True, slots=True)
class Run:
    """One take through every tracker: figures by the tracker's name."""

    motion: str
    seed: int
    figures: dict[str, Figures]


@dataclass(frozen=True, slots=True)
class Comparison:
    """All runs, in order."""

    runs: tuple[Run, ...]

    def motions(self) -> list[str]:
        """The motions, each once."""
        return list(dict.fromkeys(run.motion for run in self.runs))

    def of(self, motion: str) -> list[Run]:
        """The runs of one motion."""
        return [run for run in self.runs if run.motion == motion]

    def together(self, motion: str) -> Run:
        """All seeds of a motion as one run; its seed is 0."""
        runs = self.of(motion)
        return Run(motion, 0, {name: pooled([run.figures[name] for run in runs]) for name in runs[0].figures})


def orders(scene: Scene, motions: Iterable[str], seeds: Iterable[int], seconds: float) -> list[Order]:
    """Every motion with every seed, in scenes like this one."""
    chosen = list(seeds)
    return [Order(make_scene(scene.settings, seed), motion, seconds) for motion in motions for seed in chosen]


def compare(wanted: Sequence[Order], folder: Path, trackers: dict[str, TrackerSettings],
            told: Told = lambda title: None) -> Comparison:
    """Put every take through every tracker; takes that are not in `folder` are filmed. Raises RhotError."""
    runs: list[Run] = []
    for order in wanted:
        recorded = take(order, folder, told)
        figures = {name: judge(recorded, settings) for name, settings in trackers.items()}
        runs.append(Run(Path(order.motion).stem, order.scene.seed, figures))
    return Comparison(tuple(runs))


def judge(recorded: Take, settings: TrackerSettings) -> Figures:
    """One tracker's figures on one take, after the first second."""
    worn = worn_by(recorded.rig)
    track = tracked(recorded.records(), rig_with(recorded.rig, settings))
    track = track.where((track.times_s >= SETTLE_S) & (track.times_s <= recorded.seconds))
    return accuracy(track, deviations(track, recorded.truth, worn), recorded.truth, worn)


def as_fields(comparison: Comparison) -> dict[str, object]:
    """For JSON: every run, and each motion's seeds together."""
    return {"runs": msgspec.to_builtins([{"motion": run.motion, "seed": run.seed, **run.figures}
                                         for run in comparison.runs]),
            "motions": {motion: comparison.together(motion).figures for motion in comparison.motions()}}
