"""Trackers side by side: the same takes through each of them, the figures of every run and of all seeds together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rhot_app.evaluation.accuracy import Figures, accuracy, pooled
from rhot_app.evaluation.consistency import DEGREES, Consistency, Squares, consistency, squares
from rhot_app.evaluation.data_sets import DataSet, Order, Told, data_set
from rhot_app.evaluation.deviations import deviations, worn_by
from rhot_app.evaluation.report import SETTLE_S
from rhot_app.evaluation.track import rig_with, tracked
from rhot_app.progress import Progress, silent
from rhot_app.project import TrackerSettings
from rhot_app.simulator.nodes.node_log import CABLE, Network
from rhot_app.simulator.scene.scene import Scene, make_scene

MOTIONS = ("rest", "wave", "grasp", "pinch", "fast")
TRACKERS = {"classic": TrackerSettings(kind="classic"), "estimator": TrackerSettings(kind="estimator")}


@dataclass(frozen=True, slots=True)
class Judged:
    """One tracker on one take."""

    figures: Figures
    squares: Squares


@dataclass(frozen=True, slots=True)
class Run:
    """One take through every tracker: what came of it by the tracker's name. `motion`: the twin's own by its name, a
    recording by its file's, suffix and all, so that `pinch` and `pinch.csv` are two."""

    motion: str
    seed: int
    judged: dict[str, Judged]


@dataclass(frozen=True, slots=True)
class Comparison:
    """All runs, in order. `outdated`: how many of their takes another detector or twin would film today."""

    runs: tuple[Run, ...]
    outdated: int = 0

    def motions(self) -> list[str]:
        """The motions, each once."""
        return list(dict.fromkeys(run.motion for run in self.runs))

    def of(self, motion: str) -> list[Run]:
        """The runs of one motion."""
        return [run for run in self.runs if run.motion == motion]

    def trackers(self) -> list[str]:
        """Their names, in order."""
        return list(self.runs[0].judged)

    def together(self, motion: str, tracker: str) -> Figures:
        """The figures of all seeds of a motion."""
        return pooled([run.judged[tracker].figures for run in self.of(motion)])

    def covariance_consistency(self, motion: str, tracker: str) -> dict[str, Consistency]:
        """How true the covariances are, by quantity, over all seeds of a motion."""
        runs = [run.judged[tracker].squares for run in self.of(motion)]
        return {quantity: consistency(runs, quantity) for quantity in DEGREES}


def orders(scene: Scene, motions: Iterable[str], seeds: Iterable[int], seconds: float, *,
           network: Network = CABLE, sketched: bool = False) -> list[Order]:
    """Every motion with every seed, in scenes like this one."""
    chosen = list(seeds)
    return [Order(make_scene(scene.settings, seed), motion, seconds, network, sketched)
            for motion in motions for seed in chosen]


def compare(wanted: Sequence[Order], folder: Path, trackers: dict[str, TrackerSettings],
            told: Told = lambda title: None, progress: Progress = silent) -> Comparison:
    """Put every take through every tracker; takes that are not in `folder` are filmed. Raises RhotError."""
    runs: list[Run] = []
    outdated = 0
    for number, order in enumerate(wanted):
        recorded = data_set(order, folder, told)
        outdated += recorded.outdated
        judged = {}
        for place, (name, settings) in enumerate(trackers.items()):
            progress(f"{name} tracker, {order.title}", (number + place / len(trackers)) / len(wanted))
            judged[name] = judge(recorded, settings)
        runs.append(Run(Path(order.motion).name, order.scene.seed, judged))
    return Comparison(tuple(runs), outdated)


def judge(recorded: DataSet, settings: TrackerSettings) -> Judged:
    """One tracker on one take, after the first second."""
    worn = worn_by(recorded.rig)
    track = tracked(recorded.records(), rig_with(recorded.rig, settings))
    track = track.where((track.times_s >= SETTLE_S) & (track.times_s <= recorded.seconds))
    off = deviations(track, recorded.truth, worn)
    return Judged(accuracy(track, off, recorded.truth, worn), squares(track, off, worn))


def as_fields(comparison: Comparison) -> dict[str, object]:
    """For JSON: every run, and each motion's seeds together, with its honesty."""
    names = comparison.trackers()
    return {"outdated": comparison.outdated,
            "runs": [{"motion": run.motion, "seed": run.seed,
                      **{name: judged.figures for name, judged in run.judged.items()}} for run in comparison.runs],
            "motions": {motion: {name: comparison.together(motion, name) for name in names}
                        for motion in comparison.motions()},
            "honesty": {motion: {name: {quantity: asdict(one)
                                        for quantity, one in comparison.covariance_consistency(motion, name).items()}
                                 for name in names} for motion in comparison.motions()}}
