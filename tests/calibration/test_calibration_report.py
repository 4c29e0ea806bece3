"""What a calibration says of its result: the same figures printed, as JSON, and beside the rig's."""

from __future__ import annotations

import json

import msgspec
import numpy as np
import pytest

from rhot_app.calibration.proposal import proposed, rows_of
from rhot_app.calibration.report import Figure, Report, Table
from rhot_app.calibration.verdict import Finding, Grade, judge
from rhot_app.project import load_rig
from rhot_node.files import resource_path

GOOD = judge("rms 0.3 px", [])


@pytest.mark.parametrize(("figure", "text"), [
    (Figure("focal length", (534.31, 534.06), "px", (0.48, 0.5)), "534.31 ± 0.48, 534.06 ± 0.50 px"),
    (Figure("k3", -0.00004, sd=0.27), "0.00 ± 0.27"),
    (Figure("time", 6.0123, "ms", sd=12.3), "6 ± 12 ms"),
    (Figure("error", float("nan"), "mm"), "–"),
    (Figure("place", "not known", "mm"), "not known"),
    (Figure("views", 12, decimals=0), "12"),
])
def test_a_figure_has_the_digits_that_its_deviation_leaves_meaningful(figure: Figure, text: str) -> None:
    assert figure.text == text


def test_a_row_of_several_numbers_has_one_deviation() -> None:
    assert Figure("centre", (319.67, 239.44), "px", (0.6, 0.5), 1).brief == "319.7, 239.4 ± 0.6 px"
    assert Figure("distortion", (-0.1, 0.02), sd=(0.001, 0.2), decimals=3).brief == "-0.100, 0.020"


def test_json_has_every_key_and_no_nan() -> None:
    rows = ((Figure("camera", "left", key="name"), Figure("rms", np.nan, "px", key="rms_px")),)
    report = Report(GOOD, (Figure("focal length", (500.0, 501.0), "px", (1.0, np.nan), key="fx fy", sd_key="sd.f"),),
                    (Table("cameras", rows), Table("by", rows, by_name=True)), fields={"sd.c": np.float64(2.0)})
    said = json.loads(json.dumps(report.to_json(), allow_nan=False))
    assert (said["fx"], said["fy"], said["sd"]) == (500.0, 501.0, {"f": [1.0, None], "c": 2.0})
    assert said["cameras"] == [{"name": "left", "rms_px": None}] and said["by"]["left"]["rms_px"] is None
    assert said["grade"] == "good"
    assert report.lines()[2:4] == ["camera  rms, px", "left          –"]


def test_a_result_stands_beside_the_rigs_figure_of_its_name() -> None:
    rig = load_rig(resource_path("rigs", "two_pis.json"))
    other = msgspec.structs.replace(rig, filters=msgspec.structs.replace(rig.filters, enabled=not rig.filters.enabled))
    first, last = rows_of(rig, other, (Figure("left to right: distance", 75.01, "mm", 0.03),))
    assert first.before.endswith(" mm") and first.after == "75.010 ± 0.030 mm" and last.what == "filters"


def test_a_result_that_must_not_be_used_is_not_written(tmp_path) -> None:
    rig = load_rig(resource_path("rigs", "two_pis.json"))
    other = msgspec.structs.replace(rig, name="other")
    poor = judge("rms 9 px", [Finding("rms", Grade.POOR, "rms 9 px")])
    assert proposed("toy", Report(poor), rig, other).save(tmp_path / "rig.json") == "" and not list(tmp_path.iterdir())
    assert proposed("toy", Report(GOOD), rig, other).save(tmp_path / "rig.json") == str(tmp_path / "rig.json")
    assert load_rig(tmp_path / "rig.json").name == "other"
