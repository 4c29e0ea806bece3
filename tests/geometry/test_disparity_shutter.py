"""The thesis's depth formulas and rolling-shutter time."""

import csv
from pathlib import Path

import numpy as np
import pytest

from rhot_app.calibration.depth.fit import depth_error, depth_from_disparity, depth_from_power_law
from rhot_app.calibration.observations import row_times_ns

TABLE = Path(__file__).parents[2] / "../shared/reference/rhot_table_10_1.csv"


def test_equation_6_12_is_the_pinhole_camera():
    focal = 640 / 2 / np.tan(np.radians(62.2) / 2)
    assert depth_from_disparity(focal * 0.075 / 0.6, 0.075, 640, np.radians(62.2)) == pytest.approx(0.6)
    assert np.isnan(depth_from_disparity([0.0, -3.0, np.nan], 0.075, 640, 1.0)).all()


def test_equation_7_4_gives_the_thesis_table():
    if not TABLE.exists():
        pytest.skip(f"{TABLE} is absent: the thesis's table is needed")
    lines = [line for line in TABLE.read_text().splitlines() if not line.startswith("#")]
    rows = list(csv.DictReader(lines))
    disparity = np.abs([float(row["disparity_px"]) for row in rows])
    expected = [float(row["corrected_cm"]) for row in rows]
    np.testing.assert_allclose(depth_from_power_law(disparity, 4543.320, -1.035423), expected, atol=1e-3)


def test_equation_7_3_at_one_metre_is_about_two_centimetres():
    assert depth_error(1.0, 0.075, np.radians(0.086)) == pytest.approx(0.02, rel=0.01)


def test_lower_rows_are_later_and_lost_markers_have_the_frames_time():
    times = row_times_ns(10**15, 48_000, np.array([0.0, 100.0, 479.25, np.nan]))
    assert times.tolist() == [10**15, 10**15 + 4_800_000, 10**15 + 23_004_000, 10**15]
