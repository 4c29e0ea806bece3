"""Gaps that are filled: near the truth, bones as long as before, marked everywhere, and none that is too long."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np
import pandas
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rhot_app.__main__ import main
from rhot_app.export.gaps import FilledGap, GapFiller
from rhot_app.export.states import ARRAYS, CONDITIONS, FILLED, HandStates, joined
from rhot_app.state import Condition, Knowledge

LOST = CONDITIONS.index(Condition.LOST)


def without(states: HandStates, first: int, last: int) -> HandStates:
    """The states with the hand and all markers lost from state `first` to `last`."""
    changed: dict[str, Any] = {}
    for name in ARRAYS:
        array = getattr(states, name).copy()
        if name.endswith("knowledge"):
            array[first:last + 1] = Knowledge.UNKNOWN
        elif name == "condition":
            array[first:last + 1] = LOST
        elif array.dtype.kind == "f":
            array[first:last + 1] = np.nan
        changed[name] = array
    return replace(states, **changed)


def filled(states: HandStates, longest_s: float, sizes: list[int] | None = None) -> tuple[HandStates,
                                                                                           list[FilledGap]]:
    """All states, given to the filler in blocks of some sizes."""
    filler, out, at = GapFiller(longest_s), [], 0
    for size in sizes or [len(states)]:
        if at < len(states):
            out += filler.take(states.where(slice(at, at + size)))
            at += size
    if at < len(states):
        out += filler.take(states.where(slice(at, None)))
    return joined([*out, *filler.finish()]), filler.filled


def bones(positions: Any) -> Any:
    """(N, 15) m lengths of the fingers' bones of joints (N, 21, 3)."""
    near = [1 + 4 * finger + k for finger in range(5) for k in range(3)]
    return np.linalg.norm(positions[:, np.array(near) + 1] - positions[:, near], axis=2)


def test_a_short_gap_is_near_the_truth_and_marked(states: HandStates) -> None:
    gappy = without(states, 30, 33)
    out, gaps = filled(gappy, 0.2)
    inside = slice(30, 34)
    off = np.linalg.norm(out.joint_positions[inside] - states.joint_positions[inside], axis=2)
    assert np.nanmax(off) < 2e-3, "at 40 states a second a grasping hand bends little in a tenth of one"
    assert (out.joint_knowledge[inside] == FILLED).all() and (out.angle_knowledge[inside] == FILLED).all()
    assert out.present[inside].all() and not out.tracked[inside].any() and (out.condition[inside] == LOST).all()
    assert np.isnan(out.joint_covariances[inside]).all() and np.isnan(out.angle_sd[inside]).all()
    assert np.isfinite(out.marker_positions[inside]).all() and (out.marker_knowledge[inside] == FILLED).all()
    rest = np.r_[0:30, 34:len(states)]
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(out, name)[rest], getattr(gappy, name)[rest], err_msg=name)
    assert FilledGap("hand", 30, 33, int(states.t_master_ns[30]), int(states.t_master_ns[33])) in gaps
    assert {gap.what for gap in gaps} == {"hand", *(f"marker_{marker}" for marker in states.marker_ids)}


@pytest.mark.parametrize(("first", "last", "longest_s"), [(30, 50, 0.4), (0, 5, 1.0), (66, 71, 1.0)])
def test_a_gap_that_is_too_long_or_has_one_end_stays(states: HandStates, first: int, last: int,
                                                     longest_s: float) -> None:
    gappy = without(states, first, last)
    out, gaps = filled(gappy, longest_s)
    assert not gaps
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(out, name), getattr(gappy, name), err_msg=name)


def test_a_hand_that_turns_meanwhile_keeps_its_size(states: HandStates) -> None:
    turn = np.eye(4)
    turn[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    held = states.where(np.full(20, 40))
    late = np.arange(20) >= 12
    palms = np.where(late[:, None, None], turn @ held.world_from_palm, held.world_from_palm)
    joints = np.where(late[:, None, None], held.joint_positions @ turn[:3, :3].T, held.joint_positions)
    times = held.t_master_ns[0] + 25_000_000 * np.arange(20)
    turned = replace(held, world_from_palm=palms, joint_positions=joints, t_master_ns=times)
    out, _ = filled(without(turned, 4, 11), 1.0)
    np.testing.assert_allclose(bones(out.joint_positions), bones(held.joint_positions), atol=1e-9)
    middle = out.world_from_palm[7:9, :3, :3] @ held.world_from_palm[0, :3, :3].T
    angles = np.degrees(np.arccos((np.trace(middle, axis1=1, axis2=2) - 1.0) / 2.0))
    assert (np.abs(angles - [40.0, 50.0]) < 0.01).all(), "nine steps of ten degrees"


@settings(max_examples=25, deadline=None)
@given(sizes=st.lists(st.integers(1, 30), min_size=1, max_size=12), data=st.data())
def test_blocks_make_no_difference(states: HandStates, sizes: list[int], data: st.DataObject) -> None:
    first = data.draw(st.integers(1, 60))
    gappy = without(without(states, first, first + data.draw(st.integers(0, 9))), 10, 11)
    whole, gaps = filled(gappy, 0.15)
    parts, same = filled(gappy, 0.15, sizes)
    assert sorted(same, key=repr) == sorted(gaps, key=repr)
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(parts, name), getattr(whole, name), err_msg=name)


def test_a_table_marks_what_is_filled(gappy: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "a.csv"
    assert main(["export", str(gappy), "--out", str(out), "--rate", "40", "--fill", "1"]) == 0
    assert "gaps were filled" in capsys.readouterr().err and [one.name for one in tmp_path.iterdir()] == ["a.csv"]
    table = pandas.read_csv(out)
    lost = table[(table.time_s > 0.75) & (table.time_s < 1.35)]
    assert len(lost) > 20 and set(lost.joint_wrist_knowledge) == {FILLED} and set(lost.condition) == {"LOST"}
    assert lost.joint_wrist_x_mm.notna().all() and lost.joint_wrist_cov_xx_mm2.isna().all()


@pytest.mark.parametrize("ending", [".trc", ".c3d", ".bvh", ".glb"])
def test_a_file_without_knowledge_has_a_table_of_its_gaps(ending: str, gappy: Path, tmp_path: Path) -> None:
    out = tmp_path / f"a{ending}"
    beside = tmp_path / f"a{ending}.filled.csv"
    assert main(["export", str(gappy), "--out", str(out), "--rate", "40", "--fill", "1"]) == 0
    with beside.open(newline="") as file:
        hand = next(row for row in csv.DictReader(file) if row["what"] == "hand")
    first, last = int(hand["first_frame"]), int(hand["last_frame"])
    assert 26 <= first <= 32 and 54 <= last <= 58
    assert float(hand["begin_s"]) == pytest.approx((first - 1) / 40.0, abs=1e-3)
    if ending == ".c3d":
        points = ezc3d.c3d(str(out))["data"]["points"][:3]
        assert np.isfinite(points[:, :21, first - 1:last]).all()
    assert main(["export", str(gappy), "--out", str(out), "--rate", "40", "--force"]) == 0
    assert not beside.exists(), "the file that it belonged to is written over"
    if ending == ".c3d":
        points = ezc3d.c3d(str(out))["data"]["points"][:3]
        assert np.isnan(points[:, :21, first - 1:last]).any()


@pytest.mark.parametrize("length", ["60", "-1", "nan"])
def test_what_is_no_gap_to_fill_is_refused(length: str, gappy: Path, tmp_path: Path,
                                           capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) if length != "60" else pytest.MonkeyPatch.context():
        assert main(["export", str(gappy), "--out", str(tmp_path / "a.csv"), "--fill", length]) == 2
    assert length in capsys.readouterr().err and not list(tmp_path.iterdir())
