"""docs/twin.md names every field of the twin's file formats and the version that the program reads."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from rhot_app.simulator.film import pictures, shot
from rhot_app.simulator.render import camera_controls
from rhot_app.simulator.render import camera_controls as controls
from rhot_app.simulator.scene import motion_file, scene
from rhot_app.simulator.scene import scene_description as shows

PAGE = (Path(__file__).parents[2] / "docs" / "twin.md").read_text()
FORMATS: list[tuple[str, int, tuple[type[msgspec.Struct], ...]]] = [
    (scene.FORMAT, scene.VERSION, (scene.TwinSettings, scene.Preset, camera_controls.Lamp, controls.Controls)),
    (motion_file.FORMAT, motion_file.VERSION, (motion_file.MotionFile, motion_file.Key, motion_file.Sway)),
    (shot.FORMAT, shot.VERSION, (shot.ShotFile, shows.HandShow, shows.BareHandShow, shows.BoardShow, shows.RulerShow,
                                 shows.MarkerShow)),
    (pictures.FORMAT, pictures.VERSION, (pictures.PicturesFile, pictures.Picture)),
]


@pytest.mark.parametrize(("name", "version", "structs"), FORMATS)
def test_page_names_every_field(name: str, version: int, structs: tuple[type[msgspec.Struct], ...]) -> None:
    assert f"`{name}`, version {version}" in PAGE
    fields = {field for struct in structs for field in struct.__struct_fields__} - {"format", "version"}
    assert {field for field in fields if f"`{field}`" not in PAGE and f"`{field}[]`" not in PAGE} == set()


def test_page_names_every_default_as_it_is() -> None:
    defaults = scene.twin_defaults()
    for field, value in (("exposure_ms", "4"), ("psf_sigma_px", "0.7"), ("noise_mid_grey", "3"), ("noise_read", "1.5"),
                         ("baseline_mm", "75"), ("distance_m", "0.6"), ("shading", "0.25"), ("background", "`cloth`"),
                         ("clock_offset_hours", "5"), ("clock_drift_ppm", "50"), ("preset", "`wide`")):
        row = next(line for line in PAGE.splitlines() if line.startswith(f"| `{field}`"))
        assert row.split("|")[2].strip() == value
        actual = getattr(defaults, field)
        assert value.strip("`") == (actual if isinstance(actual, str) else f"{actual:g}")
    for name, kind in (("lamp", camera_controls.Lamp), ("controls", controls.Controls)):
        assert getattr(defaults, name) == kind(), "neutral unless somebody asks"
