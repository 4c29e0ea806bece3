"""The inverse kinematics solvers side by side: speed, residuals, limits, failures, and calm near singular poses.

Targets are free of noise and reachable. `near`: hands with coupled last joints, started 5 degrees (1 sd) off, as a
tracker would; `far`: the same from a relaxed hand; `any`: any pose within the limits, from a relaxed hand. Two paths of
one finger, each step started from the last one's angles: `stretch` runs out along the finger's own line, 2 mm beyond
its reach, and back, through the pose where the finger is straight and no joint can pull it in; `axis` passes below the
knuckle through the axis of abduction, where the finger's plane must jump by 23 degrees.

    python benchmarks/solvers.py [--hands N] [--json FILE] [--chart FILE.svg]

prints times per call of all five fingers, µs, median and p99; iterations per finger, median and most; residuals, mm,
median and worst; fingers that missed their target by more than 0.001 mm (FABRIK: 0.05 mm), and that FABRIK handed over,
%; the worst excess over a limit, degrees; and of each path the largest change of a joint in one step, degrees, and the
largest distance from the nearest reachable target, mm.
"""

from __future__ import annotations

import gc
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from fabrik_variants import COARSE, EFFORT, Fabrik, solve
from fabrik_variants import solve_arrays as variant_arrays
from joint_shapes import Shape, clamp_joint, shape_knuckles
from numpy.typing import NDArray
from solvers_chart import draw_chart
from tables import arguments, publish, table

from rhot_app.hand.anatomy import DIP_PER_PIP, load_hand
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import HandModel, build_model, neutral_pose
from rhot_app.hand.skeleton import ANGLE_SLICES, HandPose
from rhot_app.hand.solvers.methods import Method, Problem, make_problem, solve_arrays
from rhot_node.files import resource_path

Array = NDArray[Any]

EXACT_MM = 1e-3
BUDGET_US = {Method.DAMPED: 25.0, Method.LEVENBERG: 25.0, Method.CLOSED_FORM: 15.0, Fabrik.FABRIK: 40.0}
EXACT = (Method.DAMPED, Method.NEWTON, Method.LEVENBERG, Method.CLOSED_FORM)
VIOLATION_DEG = 0.1
INDEX = 1


def coupled(model: HandModel, angles: Array) -> Array:
    """The same hand with DIP = 2/3 PIP, and its thumb's last two joints bent alike in one plane with the first."""
    angles = angles.copy()
    angles[2], angles[4] = 0.0, angles[3]
    for rows in ANGLE_SLICES[1:]:
        angles[rows.start + 3] = DIP_PER_PIP * angles[rows.start + 2]
    angles = np.clip(angles, *model.limits.T)
    angles[3] = angles[4]
    return angles


def problems(model: HandModel, case: str, count: int, rng: np.random.Generator,
             knuckles: Shape = Shape.BOX) -> list[Problem]:
    """Reachable targets; with `knuckles` the poses and the limits of the problems keep that shape."""
    found = []
    for _ in range(count):
        angles = rng.uniform(*model.limits.T)
        if case != "any":
            angles = coupled(model, angles)
        for rows in ANGLE_SLICES[1:]:
            root = slice(rows.start, rows.start + 2)
            angles[root] = clamp_joint(int(knuckles), model.limits[root], *angles[root])
        start = neutral_pose()
        if case == "near":
            start = HandPose(np.eye(4), np.clip(angles + rng.normal(0.0, np.radians(5.0), 21), *model.limits.T))
            start.angles[2] = 0.0
        problem = make_problem(model, start, forward(model, HandPose(np.eye(4), angles)).marker_centres)
        found.append(problem if knuckles is Shape.BOX else shape_knuckles(problem, knuckles))
    return found


def measure(method: Method | Fabrik, cases: list[Problem]) -> dict[str, float]:
    """The figures of one method over many hands."""
    effort, handed_over = EFFORT[method], np.zeros(5, np.bool_)
    room: tuple[Array, ...] = (np.empty(5), np.empty(5, np.int64), np.empty(5, np.uint8))
    arrays: Callable[..., None] = solve_arrays
    if isinstance(method, Fabrik):
        room, arrays = (*room, np.empty((5, 4, 3)), handed_over), variant_arrays
    times, residuals, iterations, excess, handed = [], [], [], [], []
    gc.disable()
    for problem in cases:
        angles = problem.start.copy()
        before = time.perf_counter_ns()
        arrays(int(method), angles, problem.lengths, problem.limits, problem.targets, effort, *room)
        times.append(1e-3 * (time.perf_counter_ns() - before))
        residuals.append(1e3 * room[0])
        iterations.append(room[1].copy())
        handed.append(handed_over.copy())
        excess.append(np.maximum(problem.limits[:, 0] - angles, angles - problem.limits[:, 1]).max())
    gc.enable()
    missed = np.array(residuals) > max(EXACT_MM, 1e3 * effort.tolerance)
    return {"median_us": float(np.median(times)), "p99_us": float(np.percentile(times, 99)),
            "iterations": float(np.median(iterations)), "most_iterations": float(np.max(iterations)),
            "residual_mm": float(np.median(residuals)), "worst_mm": float(np.max(residuals)),
            "missed_percent": float(100.0 * missed.mean()), "handed_percent": float(100.0 * np.mean(handed)),
            "excess_deg": max(0.0, float(np.degrees(max(excess))))}


def stretch_path(model: HandModel) -> Iterator[Array]:
    """Targets of the index finger, in its frame, along its own line: out beyond its reach and back, 0.2 mm a step."""
    reach, heading = model.chain[INDEX].sum(), np.array([np.cos(0.4), 0.0, -np.sin(0.4)])
    out = np.linspace(0.95 * reach, reach + 2e-3, 1 + round((0.05 * reach + 2e-3) / 2e-4))
    for distance in np.concatenate([out, out[::-1]]):
        yield distance * heading


def axis_path(model: HandModel) -> Iterator[Array]:
    """Targets that pass below the knuckle through the axis of abduction, from one side to the other."""
    depth = 0.7 * model.chain[INDEX].sum()
    for along in np.linspace(-1.5e-2, 1.5e-2, 151):
        yield np.array([abs(along), 0.2 * along, -depth])


def follow(method: Method | Fabrik, model: HandModel, path: Iterator[Array]) -> dict[str, float]:
    """Largest change of a joint of the index finger in one step, and largest distance from what can be reached."""
    rows, reach = ANGLE_SLICES[INDEX], model.chain[INDEX].sum()
    angles, jumps, misses, first = neutral_pose().angles.copy(), [], [], True
    blank = Problem(model.chain, model.chain_bend, model.limits, angles, np.full((5, 3), np.nan))
    for target in path:
        targets = blank.targets.copy()
        targets[INDEX] = target
        solution = solve(method, replace(blank, start=angles, targets=targets))
        if not first:
            jumps.append(np.abs(solution.angles - angles)[rows].max())
        misses.append(solution.residuals[INDEX] - max(np.linalg.norm(target) - reach, 0.0))
        angles, first = solution.angles, False
    return {"jump_deg": float(np.degrees(max(jumps))), "missed_mm": float(1e3 * max(misses))}


def all_figures(model: HandModel, hands: int) -> dict[str, dict[str, dict[str, float]]]:
    """Every method's figures."""
    figures: dict[str, dict[str, dict[str, float]]] = {}
    cases = {case: problems(model, case, hands, np.random.default_rng(1)) for case in ("near", "far", "any")}
    shaped = {f"FABRIK, {shape.name.lower()} knuckles":
              {case: problems(model, case, hands, np.random.default_rng(2), shape) for case in cases}
              for shape in (Shape.CONE, Shape.PARABOLA)}
    for method in (*Method, *Fabrik):
        solve(method, cases["near"][0])  # compiled, or read from the cache
        figures[method.name] = {case: measure(method, drawn) for case, drawn in cases.items()}
        figures[method.name]["stretch"] = follow(method, model, stretch_path(model))
        figures[method.name]["axis"] = follow(method, model, axis_path(model))
    for name, drawn in shaped.items():
        figures[name] = {case: measure(Fabrik.FABRIK, own) for case, own in drawn.items()}
    return figures


def shortfalls(figures: dict[str, dict[str, dict[str, float]]]) -> list[str]:
    """What misses the targets, in words."""
    lines = []
    for method, budget in BUDGET_US.items():
        lines += [f"{method.name} {case}: {figures[method.name][case]['median_us']:.1f} µs, not {budget:g}"
                  for case in ("near", "far") if figures[method.name][case]["median_us"] > budget]
    for method in EXACT:
        coupled_only = method is Method.CLOSED_FORM
        lines += [f"{method.name} {case}: a residual of {figures[method.name][case]['worst_mm']:.1e} mm"
                  for case in (("near", "far") if coupled_only else ("near", "far", "any"))
                  if figures[method.name][case]["worst_mm"] > EXACT_MM]
    lines += [f"{name} {case}: {row[case]['excess_deg']:.2f} degrees beyond a limit"
              for name, row in figures.items() if name != Fabrik.FABRIK_FREE.name
              for case in ("near", "far", "any") if row[case]["excess_deg"] > VIOLATION_DEG]
    return lines


def main() -> int:
    """Print the table; 1 when a target is missed."""
    parser = arguments(__doc__)
    parser.add_argument("--hands", type=int, default=2000, help="per case and method")
    parser.add_argument("--chart", type=Path, help="draw the chart into this SVG file")
    options = parser.parse_args()
    model = build_model(load_hand(resource_path("hands", "right.json")))
    figures = all_figures(model, options.hands)
    missed = shortfalls(figures)
    cases = {f"{name}, {case}": of[case] for name, of in figures.items() for case in ("near", "far", "any")}
    paths = {f"{name}, {path}": of[path] for name, of in figures.items() for path in ("stretch", "axis") if path in of}
    publish(options, figures,
            *(table([head, *(name.replace("_", " ") for name in next(iter(rows.values())))],
                    [[name, *row.values()] for name, row in rows.items()])
              for head, rows in (("solver, case", cases), ("solver, path", paths))),
            "; ".join(missed) or f"All targets are met (medians of near and far; FABRIK to {1e3 * COARSE:g} mm).")
    if options.chart:
        options.chart.write_text(draw_chart(figures), encoding="utf-8")
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
