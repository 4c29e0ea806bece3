"""Depth correction: the thesis's own figures, tables as people write them, and what a bad one is told."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import numpy as np
import pytest
from synthetic_rig import make_rig

from rhot_app.__main__ import main
from rhot_app.calibration.depth.fit import (
    DepthGeometry,
    depth_from_disparity,
    fit_depth,
    geometry_of,
    replaced_calibration,
)
from rhot_app.calibration.depth.table import DepthTable, read_depth_table
from rhot_app.calibration.verdict import Grade
from rhot_app.errors import CalibrationError
from rhot_app.project import CameraCalibration, load_rig, save_rig
from rhot_app.rig_history import versions

THESIS = Path(__file__).parents[2] / "../shared/reference/rhot_table_10_1.csv"
DISTANCES_CM = np.arange(20.0, 101.0, 10.0)


def disparity(distance_cm: np.ndarray | float) -> np.ndarray:
    """What parallel cameras of the thesis's geometry would measure, px."""
    return 100.0 * DepthGeometry().constant_m / np.asarray(distance_cm)


def table_of(rows: list[str], path: Path, header: str = "real_cm,disparity_px") -> Path:
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def plain_rows(count: int = 9) -> list[str]:
    return [f"{d:g},{x:.3f}" for d, x in zip(DISTANCES_CM[:count], disparity(DISTANCES_CM)[:count], strict=True)]


def test_the_thesis_table_gives_the_thesis_figures(capsys: pytest.CaptureFixture[str]) -> None:
    if not THESIS.exists():
        pytest.skip(f"{THESIS} is absent: the thesis's table is needed")
    assert main(["calibrate", "depth", "--table", str(THESIS), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["k"] == pytest.approx(4543.320, abs=1e-3) and found["z"] == pytest.approx(-1.035423, abs=1e-6)
    lines = [line.split(",") for line in THESIS.read_text().splitlines() if line[:1].isdigit()]
    np.testing.assert_allclose(found["corrected_cm"], [float(line[6]) for line in lines], atol=1e-3)
    calculated = [row["calculated_cm"] for row in found["rows"]]
    np.testing.assert_allclose(calculated, [float(line[4]) for line in lines], atol=1e-3)
    assert found["rows"][0]["theoretical_error_cm"] == pytest.approx(2.0, abs=0.3)  # "about 2 cm" at one metre
    assert found["warnings"] == [] and found["grade"] == "good"
    assert len(found["chart"]["disparity_px"]) == len(found["chart"]["fitted_cm"])


def test_a_known_law_comes_back_with_its_uncertainty() -> None:
    rng = np.random.default_rng(4)
    off = []
    for _ in range(40):
        table = DepthTable()
        for distance in np.arange(0.2, 1.01, 0.05):
            table.add(distance, rng.normal((distance / 45.0) ** (1.0 / -1.03), 0.3, 30))
        report = fit_depth(table)
        off.append((report.z + 1.03) / report.z_sd)
    assert 0.6 < np.std(off) < 1.5 and abs(np.mean(off)) < 0.6
    assert report.rows[0].count == 30 and report.rows[0].sd_px == pytest.approx(0.3, rel=0.5)


@pytest.mark.parametrize(("header", "separator"), [
    ("real_cm,disparity_px", ","), ("real_cm,disparity_px,distance_m,disparity", ","),
    ("Distance [cm]; Disparity (px)", ";"), ("# a comment\nREAL CM\tdisparity", "\t")])
def test_tables_as_programs_and_people_write_them(tmp_path: Path, header: str, separator: str) -> None:
    rows = [row.replace(",", separator) for row in plain_rows()]
    if separator == ";":
        rows = [row.replace(".", ",") for row in rows]
    report = fit_depth(read_depth_table(table_of(rows, tmp_path / "t.csv", header)))
    assert report.z == pytest.approx(-1.0, abs=1e-4)
    assert 100 * report.k_m == pytest.approx(100.0 * DepthGeometry().constant_m, rel=1e-3)
    assert report.verdict.grade is Grade.GOOD


@pytest.mark.parametrize(("unit", "factor"), [("m", 0.01), ("mm", 10.0)])
def test_other_units_are_read_when_named_and_noticed_when_not(tmp_path: Path, unit: str, factor: float) -> None:
    rows = [f"{d * factor:g},{x}" for d, x in zip(DISTANCES_CM, disparity(DISTANCES_CM), strict=True)]
    named = fit_depth(read_depth_table(table_of(rows, tmp_path / "named.csv", f"real_{unit},disparity_px")))
    assert 100 * named.k_m == pytest.approx(100 * DepthGeometry().constant_m, rel=1e-3)
    assert named.verdict.grade is Grade.GOOD
    wrong = fit_depth(read_depth_table(table_of(rows, tmp_path / "wrong.csv")))
    assert wrong.verdict.codes == {"units"} and wrong.verdict.grade is Grade.POOR
    assert f"in {unit}, not cm" in wrong.verdict.findings[0].sentence
    assert wrong.z == pytest.approx(-1.0, abs=1e-4)


def test_a_guessed_unit_is_said(tmp_path: Path) -> None:
    verdict = fit_depth(read_depth_table(table_of(plain_rows(), tmp_path / "t.csv", "real,disparity_px"))).verdict
    assert verdict.codes == {"unit_guessed"} and verdict.grade is Grade.FAIR
    assert not fit_depth(read_depth_table(table_of(plain_rows(), tmp_path / "cm.csv"))).verdict.codes


def test_wrong_rows_are_named_and_the_rest_is_used(tmp_path: Path) -> None:
    rows = [*plain_rows(), "fifty,80", "50,0", "-5,80", "45,about 90", "60", "250,66.3"]
    report = fit_depth(read_depth_table(table_of(rows, tmp_path / "t.csv")))
    assert len(report.rows) == 9 and report.z == pytest.approx(-1.0, abs=1e-4)
    assert {row.where for row in report.rejected} == {f"line {n}" for n in (11, 12, 13, 14, 15, 16)}
    assert report.verdict.codes == {"rejected_rows"} and report.verdict.grade is Grade.FAIR
    assert "line 12: the disparity is zero" in report.verdict.findings[0].figure
    assert any("250 cm" in row.reason for row in report.rejected)


def test_signs(tmp_path: Path) -> None:
    negative = [row.replace(",", ",-") for row in plain_rows()]
    turned = fit_depth(read_depth_table(table_of(negative, tmp_path / "a.csv")))
    assert turned.verdict.grade is Grade.GOOD and turned.z == pytest.approx(-1.0, abs=1e-4)
    mixed = fit_depth(read_depth_table(table_of([*plain_rows()[:6], *negative[6:]], tmp_path / "b.csv")))
    assert mixed.verdict.codes == {"mixed_signs"} and mixed.z == pytest.approx(-1.0, abs=1e-4)


@pytest.mark.parametrize(("lines", "words"), [
    ([], "the table is empty"),
    (["real_cm,disparity_px", "20,190", "30,x"], "1 rows of the table can be used, 3 are needed"),
    (["real_cm,x", "20,190"], "no column for the disparities"),
    (["real_cm,real_cm,disparity_px", "20,20,190"], "2 columns that may be the distances"),
    (["20,190", "30,130", "40,97"], "no column for the distances"),
    (["real_cm,disparity_px", "50,76", "50,77", "50,75", "50,76"], "nearly the same distance"),
])
def test_what_is_no_table_is_refused_with_a_sentence(tmp_path: Path, lines: list[str], words: str) -> None:
    path = tmp_path / "t.csv"
    path.write_text("\n".join(lines))
    with pytest.raises(CalibrationError, match=words):
        fit_depth(read_depth_table(path))


def test_files_that_are_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_bytes(b"PK\3\4\0\0\0")
    with pytest.raises(CalibrationError, match="not a text file"):
        read_depth_table(path)
    with pytest.raises(CalibrationError, match="cannot be read"):
        read_depth_table(tmp_path / "none.csv")


@pytest.mark.parametrize(("change", "code"), [
    (lambda d: disparity(d) * (1.0 + 0.2 * np.sin(7.0 * d)), "scatter"),
    (lambda d: disparity(d) + 40.0, "exponent"),
    (lambda d: d * 2.0, "exponent"),
    (lambda d: disparity(d) * 2.0, "constant"),
    (lambda d: disparity(d)[:4], "few_rows"),
    (lambda d: disparity(np.linspace(50.0, 60.0, 9)), "narrow"),
])
def test_each_doubt_is_said(change, code: str) -> None:
    table = DepthTable()
    for distance, pixels in zip(np.linspace(50, 60, 9) if code == "narrow" else DISTANCES_CM,
                                np.atleast_1d(change(DISTANCES_CM)), strict=False):
        table.add(0.01 * distance, [pixels])
    verdict = fit_depth(table).verdict
    assert code in verdict.codes
    assert all(finding.remedy for finding in verdict.findings)


def test_the_rig_is_written_when_asked_and_good(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rig_path, table = tmp_path / "rig.json", table_of(plain_rows(), tmp_path / "t.csv")
    save_rig(rig_path, msgspec.structs.replace(make_rig(), calibration=CameraCalibration("board", "ruler", 5e-4)))
    arguments = ["calibrate", "depth", "--table", str(table), "--rig", str(rig_path), "--out", str(rig_path)]
    assert main(arguments) == 0
    assert "calibrated cameras" in capsys.readouterr().out, "what is replaced is said"
    rig = load_rig(rig_path)
    assert replaced_calibration(rig) == [], "distances are from disparity already"
    assert rig.depth.mode == "disparity" and rig.depth.k == pytest.approx(DepthGeometry().constant_m, rel=1e-3)
    assert geometry_of(rig).width_px == 640 and len(versions(rig_path)) == 1
    metres = table_of([f"{0.01 * d:g},{x}" for d, x in zip(DISTANCES_CM, disparity(DISTANCES_CM), strict=True)],
                      tmp_path / "m.csv")
    capsys.readouterr()
    assert main(["calibrate", "depth", "--table", str(metres), "--rig", str(rig_path), "--out",
                 str(tmp_path / "new.json"), "--json"]) == 2
    assert not (tmp_path / "new.json").exists()
    assert json.loads(capsys.readouterr().out)["written"] is None
    assert main(["calibrate", "depth", "--table", str(table), "--out", str(rig_path)]) == 2
    assert "--rig" in capsys.readouterr().err


def test_theory_and_law_agree_for_parallel_cameras() -> None:
    geometry = DepthGeometry()
    assert geometry.constant_m == pytest.approx(39.785, abs=1e-3)
    expected = depth_from_disparity(100.0, geometry.baseline_m, 640, geometry.view_angle_rad)
    assert geometry.constant_m / 100.0 == pytest.approx(float(expected))
