"""Trackers side by side: the same takes through each of them, the figures of every run and of all seeds together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from rhot_app.errors import SimulatorError
from rhot_app.evaluation.accuracy import (
    DEGREES,
    Consistency,
    Figures,
    Squares,
    accuracy,
    band,
    consistency,
    deviations,
    pooled,
    ratio,
    squares,
    worn_by,
)
from rhot_app.evaluation.data_sets import DataSet, Order, Watch, data_set
from rhot_app.evaluation.run import SETTLE_S
from rhot_app.evaluation.score import cell
from rhot_app.evaluation.track import rig_with, tracked
from rhot_app.progress import Progress, silent
from rhot_app.project import TrackerSettings
from rhot_app.simulator.film.node_log import CABLE, Network
from rhot_app.simulator.scene.scene import Scene, make_scene
from rhot_node.files import read_json

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
            watch: Watch = lambda title: None, progress: Progress = silent) -> Comparison:
    """Put every take through every tracker; takes that are not in `folder` are filmed. Raises RhotError."""
    runs: list[Run] = []
    outdated = 0
    for number, order in enumerate(wanted):
        recorded = data_set(order, folder, watch)
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


@dataclass(frozen=True, slots=True)
class Column:
    """One figure: its key, its heading, its form, and whether a ratio says anything."""

    key: str
    heading: str
    form: str
    compared: bool = True


COLUMNS = (
    Column("tip_visible_mm", "tips visible mm", ".2f"), Column("tip_measured_mm", "tips measured mm", ".2f"),
    Column("tip_display_mm", "tips displayed mm", ".2f"),
    Column("tip_predicted_mm", "tips predicted mm", ".2f", compared=False),
    Column("predicted_3_sd_share", "predicted 3 sg", ".3f", compared=False), Column("marker_mm", "markers mm", ".2f"),
    Column("angles_deg", "angles deg", ".1f"), Column("palm_turn_deg", "palm turn deg", ".1f"),
    Column("swaps", "swaps", ".0f", compared=False), Column("measured_share", "measured", ".3f", compared=False),
    Column("states_per_s", "states/s", ".0f", compared=False),
)
_CELL = 7

LEGEND = """\
Root mean squares over all states after the first second; ratio: the last tracker's figure to the first one's.
  tips       fingertips: visible to both cameras in truth, called measured by the tracker, as a 60 Hz display shows them
             (the newest state), and as the tracker predicts them at the display's instants;
             predicted 3 sg: part of their axes within three of its standard deviations
  markers    that both cameras see in truth
  angles     joint angles of the fingers that wear markers
  palm turn  between the palm and the true one
  swaps      states that show one fingertip where another one is, once each time it happens
  measured   part of what both cameras see that the tracker calls measured
  states/s   states per second: the classic tracker makes one per pair of frames, the estimator one per frame
NEES is 1 where covariances are true, more where they are too small, less where they are too large."""


def table(comparison: Comparison, columns: Sequence[Column] = COLUMNS) -> str:
    """One line per run, and one for all seeds of each motion; under each figure the trackers and the ratio of the last
    tracker's to the first one's."""
    trackers = comparison.trackers()
    names = [_name(run) for motion in comparison.motions() for run in comparison.of(motion)]
    width = max(len(name) for name in [*names, *comparison.motions()]) + 2
    lines = _heads(width, trackers, columns)
    for motion in comparison.motions():
        runs = comparison.of(motion)
        if len(runs) > 1:
            lines += [_line(_name(run), width, [run.judged[name].figures for name in trackers], columns)
                      for run in runs]
        lines.append(_line(motion, width, [comparison.together(motion, name) for name in trackers], columns))
    return "\n".join(lines)


def consistency_table(comparison: Comparison) -> str:
    """Per motion and tracker: average NEES by quantity, its share inside the band, and what is within 3 sigma."""
    seeds = len(comparison.of(comparison.motions()[0]))
    heads = "".join(f"{quantity + ' ' + _span(seeds, degrees):>22}" for quantity, degrees in DEGREES.items())
    words = f"{'NEES':>8}{'inside':>7}{'3 sg':>7}"
    margin = max(len(motion) for motion in comparison.motions()) + 1
    lines = [f"NEES by its degrees of freedom, with the 95 % band of the mean of {seeds} seeds; part of the instants "
             "inside it; part of what is called measured (of palms: of all) within 3 sigma",
             " " * (margin + 8) + heads, " " * (margin + 8) + words * len(DEGREES)]
    for motion in comparison.motions():
        for tracker in comparison.trackers():
            found = comparison.covariance_consistency(motion, tracker)
            cells = "".join(f"{cell(one.average, '.2f'):>8}{cell(one.inside, '.2f'):>7}{cell(one.within, '.3f'):>7}"
                            for one in found.values())
            lines.append(f"{motion:<{margin}}{tracker[:7]:<8}{cells}")
    return "\n".join(lines)


@dataclass(frozen=True, slots=True)
class Baseline:
    """Figures kept of an earlier tracker, by motion; `name` says which."""

    name: str
    motions: dict[str, Figures]


def read_baseline(path: Path) -> Baseline:
    """Raises SimulatorError for a file that keeps no figures by motion."""
    document = read_json(path, SimulatorError)
    kept = document.get("motions") if isinstance(document, dict) else None
    if not isinstance(kept, dict) or not all(isinstance(figures, dict) for figures in kept.values()):
        raise SimulatorError(f"{path}: not a baseline, which has figures by motion; see benchmarks/baselines.")
    return Baseline(f"{path.name}: {document.get('tracker', 'unnamed')}", kept)


def baseline_table(comparison: Comparison, baseline: Baseline) -> str:
    """The last tracker's figures over those of the baseline, by motion."""
    tracker, columns = comparison.trackers()[-1], [column for column in COLUMNS if column.form != ".0f"]
    lines = [f"{tracker} over the baseline ({baseline.name})",
             " " * 8 + "".join(f"{column.heading:>19}" for column in columns)]
    for motion in comparison.motions():
        now, before = comparison.together(motion, tracker), baseline.motions.get(motion, {})
        lines.append(f"{motion:<8}" + "".join(
            f"{cell(ratio(now[column.key], before.get(column.key)), '.2f'):>19}" for column in columns))
    return "\n".join(lines)


def _span(seeds: int, degrees: int) -> str:
    low, high = band(seeds, degrees)
    return f"{low:.2f}-{high:.2f}"


def _name(run: Run) -> str:
    return f"  {run.motion} {run.seed}"


def _heads(margin: int, trackers: Sequence[str], columns: Sequence[Column]) -> list[str]:
    first, second = " " * margin, " " * margin
    for column in columns:
        under = [*trackers, "ratio"] if _has_ratio(column, trackers) else list(trackers)
        words = "".join(word[:_CELL].rjust(_CELL + 1) for word in under)
        width = _width(column, trackers)
        first += "  " + column.heading.rjust(width)
        second += "  " + words.rjust(width)
    return [first, second]


def _line(name: str, width: int, figures: Sequence[Figures], columns: Sequence[Column]) -> str:
    line = name.ljust(width)
    for column in columns:
        values = [one[column.key] for one in figures]
        cells = [cell(value, column.form) for value in values]
        if _has_ratio(column, figures):
            cells.append(cell(ratio(values[-1], values[0]), ".2f"))
        line += "  " + "".join(text.rjust(_CELL + 1) for text in cells).rjust(_width(column, figures))
    return line


def _width(column: Column, trackers: Sequence[object]) -> int:
    """Of a figure's cells, one for each tracker and perhaps one for the ratio, or of its heading."""
    return max(len(column.heading), (_CELL + 1) * (len(trackers) + _has_ratio(column, trackers)))


def _has_ratio(column: Column, trackers: Sequence[object]) -> bool:
    return column.compared and len(trackers) > 1
