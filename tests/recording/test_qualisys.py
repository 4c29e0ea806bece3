"""Qualisys exports: points with their names and times, and files that are none."""

from pathlib import Path

import numpy as np
import pytest

from rhot_app.errors import RecordingError
from rhot_app.recording.qualisys import read_qualisys

HEADER = "NO_OF_FRAMES\t2\nFREQUENCY\t100\nMARKER_NAMES\ta\tb\nTRAJECTORY_TYPES\tMeasured\tMeasured\n"
FRAME = "Frame\tTime\ta X\ta Y\ta Z\tb X\tb Y\tb Z\t\n"


def write(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def test_points_are_metres_and_missing_ones_are_nan(tmp_path: Path) -> None:
    rows = "1\t2.50000\t1000.0\t-200.0\t3.0\t0.000\t0.000\t0.000\t\n2\t2.51000\t1001.0\t-200.0\t3.0\t\t\t\t\n"
    tracks = read_qualisys(write(tmp_path / "a.tsv", HEADER + FRAME + rows))
    assert tracks.names == ("a", "b")
    np.testing.assert_allclose(tracks.times_s, [0.0, 0.01])
    np.testing.assert_allclose(tracks.positions[:, 0], [[1.0, -0.2, 0.003], [1.001, -0.2, 0.003]])
    assert np.isnan(tracks.positions[:, 1]).all()


@pytest.mark.parametrize(("text", "words"), [
    ("", "header is incomplete"), (HEADER, "header is incomplete"), (HEADER + FRAME, "holds no frames"),
    (HEADER + FRAME + "1\t0.0\t1.0\n", "line 6 has 3 columns, not 8"),
    (HEADER + FRAME + "1\t0.0\tx\t0\t0\t0\t0\t0\n", "could not convert"),
])
def test_files_that_are_none_are_named(tmp_path: Path, text: str, words: str) -> None:
    path = write(tmp_path / "bad.tsv", text)
    with pytest.raises(RecordingError, match=words) as caught:
        read_qualisys(path)
    assert str(path) in str(caught.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"no\.tsv"):
        read_qualisys(tmp_path / "no.tsv")
