"""Object files: what helpers make is what is read back, and what cannot be is refused with a sentence."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from object_scenes import CUBE

from rhot_app.errors import ObjectError
from rhot_app.objects.object_file import (
    Mesh,
    ObjectMarker,
    ObjectModel,
    Tag,
    cube,
    load_object,
    plate,
    require_distinct,
    save_object,
)

TAG = {"family": "DICT_4X4_50", "id": 3, "size_mm": 20.0}
MARKERS = [{"marker": name, "position_mm": place} for name, place in (
    ("red", [0, 0, 0]), ("green", [50, 0, 0]), ("blue", [0, 40, 0]))]

vectors = st.tuples(*[st.floats(-500.0, 500.0)] * 3)
quaternions = st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: sum(x * x for x in q) > 0.01).map(
    lambda q: tuple(x / math.sqrt(sum(y * y for y in q)) for x in q))


@st.composite
def models(draw: st.DrawFn) -> ObjectModel:
    numbers = draw(st.lists(st.integers(0, 249), min_size=1, max_size=6, unique=True))
    mesh = draw(st.none() | st.builds(Mesh, st.just("cube.stl"), st.sampled_from(["m", "mm"])))
    return ObjectModel("thing", tuple(
        Tag("DICT_6X6_250", number, draw(st.floats(1.0, 500.0)), draw(quaternions), draw(vectors))
        for number in numbers), mesh=mesh)


def written(folder: Path, **fields: Any) -> Path:
    path = folder / f"{fields.get('name', 'thing')}.json"
    path.write_text(json.dumps({"format": "rhot-object", "version": 1, "name": "thing", **fields}))
    return path


@given(models())
def test_a_model_survives_its_file(model: ObjectModel) -> None:
    assert msgspec.json.decode(msgspec.json.encode(model), type=ObjectModel) == model


def test_a_file_is_written_and_read(tmp_path: Path) -> None:
    save_object(tmp_path / "cube.json", CUBE)
    assert load_object(tmp_path / "cube.json") == CUBE


def test_a_cubes_tags_look_outward_from_its_faces() -> None:
    for tag in CUBE.fiducials:
        corners = tag.corners()
        middle = corners.mean(axis=0)
        normal = np.cross(corners[1] - corners[2], corners[3] - corners[2])
        np.testing.assert_allclose(1e3 * np.linalg.norm(middle), 30.0)
        np.testing.assert_allclose(normal / np.linalg.norm(normal), middle / np.linalg.norm(middle), atol=1e-12)
        np.testing.assert_allclose(1e3 * np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1), 45.0)
    assert len({tuple(np.round(tag.corners().mean(axis=0), 6)) for tag in CUBE.fiducials}) == 6


def test_a_plates_tags_go_row_by_row() -> None:
    model = plate("plate", 3, 2, 20.0, 5.0, "DICT_4X4_50", 7)
    assert [tag.id for tag in model.fiducials] == [7, 8, 9, 10, 11, 12]
    assert model.fiducials[0].translation_mm == (-25.0, 12.5, 0.0)
    assert model.fiducials[5].translation_mm == (25.0, -12.5, 0.0)


@pytest.mark.parametrize(("fields", "says"), [
    ({"fiducials": [{**TAG, "family": "DICT_9X9_50"}]}, "no tag dictionary 'DICT_9X9_50'"),
    ({"fiducials": [{**TAG, "size_mm": 0}]}, "size_mm"),
    ({"fiducials": [{**TAG, "size_mm": -20}]}, "size_mm"),
    ({"fiducials": [{**TAG, "id": 50}]}, "there is no 50"),
    ({"fiducials": [{**TAG, "rotation_wxyz": [1, 1, 0, 0]}]}, "unit quaternion"),
    ({"fiducials": [TAG, TAG]}, "stands twice"),
    ({"fiducials": [TAG, {**TAG, "family": "DICT_4X4_1000"}]}, "stands twice"),  # the same bits
    ({"fiducials": [TAG], "markers": MARKERS}, "give one of the two"),
    ({"markers": MARKERS[:2]}, "in one line"),
    ({"markers": [*MARKERS[:2], {"marker": "blue", "position_mm": [90, 0.1, 0]}]}, "in one line"),
    ({"markers": [*MARKERS, MARKERS[0]]}, "stands twice"),
    ({"fiducials": [TAG], "mesh": {"file": "a.stl", "unit": "inch"}}, "mesh.unit"),
    ({"fiducials": [TAG], "version": 2}, "version 2"),
    ({"fiducials": [TAG], "colour": "red"}, "colour"),
])
def test_what_cannot_be_is_refused_with_file_and_reason(tmp_path: Path, fields: dict[str, Any], says: str) -> None:
    path = written(tmp_path, **fields)
    with pytest.raises(ObjectError) as caught:
        load_object(path)
    assert str(caught.value).startswith(str(path)) and says in str(caught.value)


def distinct(*paths: Path) -> None:
    require_distinct([load_object(path) for path in paths], [str(path) for path in paths])


def test_two_objects_that_look_alike_are_refused(tmp_path: Path) -> None:
    first = written(tmp_path, name="a", fiducials=[TAG])
    for name, fields, says in (("b", {"fiducials": [{**TAG, "size_mm": 30.0}]}, "tag 3 of DICT_4X4_50"),
                               ("c", {"fiducials": [{**TAG, "family": "DICT_4X4_250"}]}, "tag 3 of DICT_4X4_250")):
        with pytest.raises(ObjectError, match=says):
            distinct(first, written(tmp_path, **fields, name=name))
    painted = [written(tmp_path, name=name, markers=MARKERS) for name in ("d", "e")]
    with pytest.raises(ObjectError, match="marker 'red'"):
        distinct(*painted)
    distinct(first, painted[0])
    with pytest.raises(ObjectError, match="called"):
        distinct(first, first)
    with pytest.raises(ObjectError, match="no such file"):
        load_object(tmp_path / "nowhere.json")


@pytest.mark.parametrize("make", [
    lambda: cube("c", 40.0, 50.0, "DICT_4X4_50"), lambda: cube("c", 40.0, 0.0, "DICT_4X4_50"),
    lambda: cube("c", 40.0, 30.0, "DICT_4X4_50", 46), lambda: plate("p", 0, 1, 20.0, 2.0, "DICT_4X4_50"),
    lambda: plate("p", 1, 1, -20.0, 2.0, "DICT_4X4_50"), lambda: ObjectModel("m", markers=(
        ObjectMarker("red", (0.0, 0.0, 0.0)), ObjectMarker("blue", (1.0, 0.0, 0.0))))])
def test_helpers_refuse_what_cannot_be(make: Any) -> None:
    with pytest.raises(ValueError):
        make()
