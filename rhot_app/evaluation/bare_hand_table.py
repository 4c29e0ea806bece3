"""The table of `rhot evaluate bare-hand`, with published figures of other trackers beside it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Final

from rhot_app.evaluation.bare_hand import Case, EvaluatedRun, Figures, figures_of
from rhot_app.evaluation.score import cell


@dataclass(frozen=True, slots=True)
class PublishedFigure:
    """What others measured with other hands, other truths and other pictures: an order of magnitude, no comparison.
    `truth`: what they measured against; `beside`: the columns of the table that come nearest."""

    tracker: str
    quantity: str
    value: float
    unit: str
    truth: str
    source: str
    beside: str


_DORTMUND: Final = "Sensors 2025, 25(24), 7473"
_SPRAGUE: Final = "Sprague et al., Sensors 2025, 25(18), 5716"
_ABDLKARIM: Final = "Abdlkarim et al., bioRxiv 2022.02.18.481001"

PUBLISHED: Final = (
    PublishedFigure("Leap Motion Controller 2", "palm position", 5.2, "mm", "a printed hand on a robot", _DORTMUND,
                    "joints mm"),
    PublishedFigure("Leap Motion Controller 2", "joint angles, rms", 14.8, "deg", "markers, 11 people", _SPRAGUE,
                    "angles deg"),
    PublishedFigure("Meta Quest 2", "fingertip position", 11.0, "mm", "a grid of targets", _ABDLKARIM, "joints mm"),
    PublishedFigure("Meta Quest 2", "latency", 38.0, "ms", "the same; 45 in the journal", _ABDLKARIM,
                    "p99 ms"),
    PublishedFigure("MediaPipe Hands", "joint angles, rms", 22.5, "deg", "markers, 11 people", _SPRAGUE, "angles deg"),
)

COLUMNS: Final = (
    ("joint_mm_median", "median", ".1f"), ("joint_mm_p95", "p95", ".1f"), ("joint_mm_worst_seed", "worst", ".1f"),
    ("exact_mm_median", "exact", ".1f"),
    ("angle_deg_median", "median", ".1f"), ("angle_deg_p95", "p95", ".1f"), ("angle_deg_worst_seed", "worst", ".1f"),
    ("image_px_median", "median", ".1f"), ("image_px_p95", "p95", ".1f"),
    ("within_3_sd", "3 sg", ".3f"), ("lost_part", "lost", ".3f"), ("start_s_median", "start s", ".2f"),
    ("started", "started", ".0f"), ("rate_hz_median", "Hz", ".0f"), ("step_ms_p99", "p99 ms", ".0f"))
_GROUPS: Final = (("joints mm", 4), ("angles deg", 3), ("image px", 2), ("", 6))
_WIDTH: Final = 8

LEGEND: Final = """\
Over all judged frames of all seeds; worst: the seed with the largest mean.
  joints, angles  mean error of the 21 joints, and of the 21 angles, of a frame
  exact           what exact image points would give with the tracker's calibration, median
  image           the same of the joints in the first camera's picture
  3 sg            part of the joints within three sigma of their covariance (0.997 where it is true)
  lost            part of the frames that show the whole hand and have no state, or one off by more than 20 mm
  start           from the first frame that shows the whole hand, or the end of a loss, to the first good state; in how
                  many seeds there was one
  Hz, p99         steps of the tracker on this machine, one process"""


def bare_hand_table(found: Sequence[tuple[Case, Sequence[EvaluatedRun]]]) -> str:
    """One line per case, what the columns mean, and the published figures."""
    margin = max(len(case.name) for case, _ in found) + 1
    lines = [" " * margin + "".join(name.center(count * _WIDTH) for name, count in _GROUPS).rstrip(),
             " " * margin + "".join(heading.rjust(_WIDTH) for _, heading, _ in COLUMNS)]
    for case, runs in found:
        figures = figures_of(runs)
        lines.append(case.name.ljust(margin) + "".join(cell(figures[key], form).rjust(_WIDTH)
                                                       for key, _, form in COLUMNS))
    return "\n".join([*lines, "", LEGEND, "", *published_lines()])


def published_lines() -> list[str]:
    """Figures of other trackers, a line each."""
    return ["Published figures of other trackers, each with its own hands and truth. The columns beside which they "
            "stand are",
            "medians over frames of a frame's mean absolute error against exact truth; a step (p99 ms) is a part of a",
            "latency.",
            *(f"  {one.tracker:<25} {one.quantity:<19} {f'{one.value:g} {one.unit}':<9} beside {one.beside:<12} "
              f"against {one.truth} ({one.source})" for one in PUBLISHED)]


def bare_hand_fields(found: Sequence[tuple[Case, Sequence[EvaluatedRun]]], seconds: float) -> dict[str, object]:
    """For JSON: each case's figures, those of each of its seeds, and the published ones."""
    def of_run(run: EvaluatedRun) -> dict[str, object]:
        figures: Figures = figures_of([run])
        return {"seed": run.seed, "motion": run.motion, **figures}

    return {"seconds": seconds,
            "cases": {case.name: {**figures_of(runs), "runs": [of_run(run) for run in runs]} for case, runs in found},
            "published": [asdict(one) for one in PUBLISHED]}
