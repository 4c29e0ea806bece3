"""Marker files: what says how paint lies, files from before it, and errors that name what is wrong."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from rhot_node.errors import SettingsError
from rhot_node.files import decode_document, resource_path
from rhot_node.markers import MarkerSet, load_markers, save_markers

CHROMA = {"cb": -89.2, "cr": 26.3}


def marker_file(**fields: Any) -> bytes:
    marker = {"id": "index", "role": "index_tip", "shape": "disc", "display_rgb": [225, 200, 30], "chroma": CHROMA}
    return json.dumps({"format": "rhot-markers", "version": 1, "markers": [marker | fields]}).encode()


def read(**fields: Any) -> MarkerSet:
    return decode_document(marker_file(**fields), MarkerSet, format_name="rhot-markers", version=1, where="mine.json",
                           error=SettingsError)


def test_a_file_from_before_patches_means_whole_segments(tmp_path: Path) -> None:
    old = resource_path("markers", "rhot6.json")
    assert not {"patch", "gap_deg", "rest_rgb", "rest_mm"} & set(json.loads(old.read_text())["markers"][0])
    markers = load_markers(old)
    assert {(m.patch, m.gap_deg, m.rest_rgb, m.rest_mm) for m in markers.markers} == {("segment", 0.0, None, 0.0)}
    save_markers(tmp_path / "again.json", markers)
    written = json.loads((tmp_path / "again.json").read_text())
    assert not any("patch" in marker or "gap_deg" in marker for marker in written["markers"]), \
        "a program from before patches reads what is written without them"
    assert load_markers(tmp_path / "again.json") == markers


@pytest.mark.parametrize("fields", [
    {"patch": "nail", "length_mm": 11}, {"patch": "pulp", "length_mm": 8},
    {"patch": "ring", "shape": "capsule", "gap_deg": 40, "gap_side": "dorsal", "rest_rgb": [235, 232, 225]},
    {"role": "wrist", "shape": "band", "gap_deg": 180, "rest_rgb": [0, 0, 0]},
    {"role": "other_wrist", "shape": "band", "length_mm": 11, "rest_mm": 11, "rest_rgb": [0, 0, 0]}])
def test_paint_survives_being_written(fields: dict[str, Any], tmp_path: Path) -> None:
    markers = read(**fields)
    for name, value in fields.items():
        told = getattr(markers.markers[0], name)
        assert (list(told) if isinstance(told, tuple) else told) == value
    save_markers(tmp_path / "again.json", markers)
    assert load_markers(tmp_path / "again.json") == markers


@pytest.mark.parametrize(("fields", "said"), [
    ({"patch": "toe"}, r"markers\[0\]\.patch: 'toe' is not one of"),
    ({"patch": "nail", "role": "wrist"}, r"marker 'index': patch \"nail\" is for fingertips"),
    ({"patch": "nail", "role": None}, "is for fingertips"),
    ({"patch": "pulp", "shape": "capsule"}, r'flat; give it the shape "disc"'),
    ({"gap_deg": 40}, 'gap_deg is of a wrist'),
    ({"patch": "nail", "gap_deg": 40}, 'gap_deg is of a wrist'),
    ({"patch": "ring", "gap_deg": 360}, "gap_deg: "),
    ({"rest_mm": 5, "rest_rgb": [1, 2, 3]}, "rest_mm is of a wrist"),
    ({"role": "wrist", "rest_mm": 5}, "rest_mm needs rest_rgb"),
    ({"role": "wrist", "rest_rgb": [1, 2, 3]}, "rest_rgb needs gap_deg or rest_mm")])
def test_paint_that_cannot_be_is_named(fields: dict[str, Any], said: str) -> None:
    with pytest.raises(SettingsError, match=said) as error:
        read(**fields)
    assert str(error.value).startswith("mine.json: ")
