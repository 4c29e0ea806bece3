"""The pages about file formats name every field that the programs read, and say the version they read."""

from __future__ import annotations

import re
from pathlib import Path

import msgspec
import pytest

from rhot_app import project
from rhot_app.calibration.lens import intrinsics
from rhot_app.hand import anatomy, articulated
from rhot_app.objects import object_file
from rhot_app.objects.alignment import alignment_file
from rhot_app.objects.state import ObjectState
from rhot_app.state import HandState
from rhot_node import config, markers

DOCS = Path(__file__).parents[2] / "docs"

PAGES: tuple[tuple[str, str, int, tuple[type[msgspec.Struct], ...]], ...] = (
    ("rig.md", project.FORMAT, project.VERSION, (
        project.Rig, project.RigNode, project.Intrinsics, project.CameraPose, project.CameraCalibration,
        project.RigObject, project.Broadcast, project.FilterSettings, project.OneEuroSettings)),
    ("markers.md", markers.FORMAT, markers.VERSION, (
        markers.MarkerSet, markers.Marker, markers.ChromaModel, markers.RangeModel)),
    ("calibration-files.md", intrinsics.FORMAT, intrinsics.VERSION, (
        intrinsics.IntrinsicsFile, intrinsics.BoardUsed)),
    ("alignment.md", alignment_file.FORMAT, alignment_file.VERSION, (
        alignment_file.Alignment, alignment_file.RigidTransform)),
    ("objects.md", object_file.FORMAT, object_file.VERSION, (
        object_file.ObjectModel, object_file.Tag, object_file.ObjectMarker, object_file.Mesh, object_file.BoxShape,
        object_file.SphereShape, object_file.CylinderShape)),
    ("hand.md", anatomy.FORMAT, anatomy.VERSION, (anatomy.HandAnatomy, anatomy.FingerAnatomy, anatomy.Coupling)),
    ("hand.md", articulated.FORMAT, articulated.VERSION, (
        articulated.Articulated, articulated.Root, articulated.ArticulatedFrame, articulated.Angle, anatomy.Coupling,
        articulated.Point, articulated.Capsule, articulated.Box)),
    ("node.md", config.FORMAT, config.VERSION, (
        config.NodeSettings, config.CameraSettings, config.TagSettings, config.ClockSettings)),
)


def test_the_sample_settings_of_a_node_are_ones(tmp_path: Path) -> None:
    sample = re.search(r"```json\n(.*?)```", (DOCS / "node.md").read_text(), re.DOTALL)
    assert sample is not None, "docs/node.md shows no settings file"
    path = tmp_path / "node.json"
    path.write_text(sample[1])
    assert config.load_settings(path).name == "left"


@pytest.mark.parametrize(("page", "format_name", "version", "structs"), PAGES)
def test_the_page_names_every_field(page: str, format_name: str, version: int,
                                    structs: tuple[type[msgspec.Struct], ...]) -> None:
    text = (DOCS / page).read_text()
    one_line = rf'`"?{format_name}"?`,( version)? `?{version}\b'
    two_rows = rf'`"{format_name}"` .*\n.*`version` .*`{version}`'
    assert re.search(f"{one_line}|{two_rows}", text), f"docs/{page} does not say {format_name}, version {version}"
    missing = [f"{struct.__name__}.{field}" for struct in structs for field in struct.__struct_fields__
               if f"`{field}`" not in text]
    assert not missing, f"docs/{page} does not explain {', '.join(missing)}"


def test_the_page_about_states_names_every_field() -> None:
    text = (DOCS / "states.md").read_text()
    missing = [name for name in HandState.__slots__ if f"`{name}`" not in text]
    assert not missing, f"docs/states.md does not explain {', '.join(missing)}"
    text = (DOCS / "objects.md").read_text()
    missing = [name for name in ObjectState.__slots__ if f"`{name}`" not in text]
    assert not missing, f"docs/objects.md does not explain {', '.join(missing)}"
