"""How many numbers the estimator depends on that somebody chose."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

APP = Path(__file__).parents[2] / "rhot_app"
FILES = [APP / "estimation" / f"{name}.py" for name in ("filter", "residual")] + [
    APP / "hand" / "motion" / "hand_process.py"] + [
    APP / "tracking" / "extrapolation.py"] + [
    APP / "tracking" / "markers" / f"{name}.py" for name in ("acquisition", "estimator", "estimator_state",
                                                             "marker_model", "marker_residual")]
"""The estimator, its residuals, its process, its start, and what it publishes."""

LAYOUT = frozenset(("POSE", "MOTION", "WORLD", "ANGLES", "VELOCITY", "ACCELERATION", "BIAS", "_FIRST_TIP",
                    "_FIRST_MARKER", "_FIRST_ANGLE", "_GROUPS", "_NEVER", "_FINGERTIPS", "_FINGER_OF_JOINT",
                    "_FINGER_OF_ANGLE", "_GAUSSIAN", "_STUDENT"))
"""Where numbers stand in an array, and codes: nothing to choose."""


def chosen(path: Path) -> list[str]:
    """Numbers of the constants of a file, each with its name."""
    found = []
    for node in ast.parse(path.read_text()).body:
        if not isinstance(node, ast.Assign):
            continue
        names = [name.id for target in node.targets for name in ast.walk(target) if isinstance(name, ast.Name)]
        if LAYOUT & set(names) or not all(name.upper() == name for name in names):
            continue
        numbers = [leaf.value for leaf in ast.walk(node.value)
                   if isinstance(leaf, ast.Constant) and type(leaf.value) in (int, float)]
        found += [f"{path.stem}.{names[0]} {number}" for number in numbers]
    return found


@pytest.mark.parametrize("most", [
    64, pytest.param(25, marks=pytest.mark.xfail(strict=True, reason="the aim; there are 64"))])
def test_the_estimator_has_few_constants(most: int) -> None:
    found = [one for path in FILES for one in chosen(path)]
    assert len(found) <= most, f"{len(found)} numbers:\n" + "\n".join(found)
