"""``rhot history``: earlier versions of a rig file are listed and brought back."""

from __future__ import annotations

import json
from pathlib import Path

import msgspec
import pytest

from rhot_app import rig_history
from rhot_app.__main__ import main
from rhot_app.project import load_rig
from rhot_node.files import resource_path


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A rig file with two earlier versions, "one" and "two"; it is "three" now."""
    rig = load_rig(resource_path("rigs", "two_pis.json"))
    path = tmp_path / "desk.json"
    for name, reason in (("one", "first"), ("two", "stereo calibration"), ("three", "bone lengths")):
        rig_history.accept(path, msgspec.structs.replace(rig, name=name), reason)
    return path


def test_versions_are_listed_newest_first(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["history", "--rig", str(path), "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["versions"]
    assert [each["number"] for each in listed] == [1, 2]
    assert [each["replaced_by"] for each in listed] == ["bone lengths", "stereo calibration"]
    assert main(["history", "--rig", str(path)]) == 0
    assert "2 earlier versions" in capsys.readouterr().out


def test_a_version_is_brought_back_and_the_present_one_kept(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["history", "--rig", str(path), "--restore", "2"]) == 0
    assert "before the stereo calibration" in capsys.readouterr().out
    assert load_rig(path).name == "one"
    assert load_rig(rig_history.versions(path)[0].path).name == "three"


def test_a_number_that_is_not_listed_changes_nothing(path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["history", "--rig", str(path), "--restore", "3"]) == 2
    said = capsys.readouterr().err
    assert "has no version" in said and "counting begins at 1" in said
    assert load_rig(path).name == "three"


def test_a_missing_rig_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["history", str(tmp_path / "none.json")]) == 2
    assert "no such file" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["check", "history"])
def test_no_rig_at_all_is_asked_for_by_its_option(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([command]) == 2
    assert "--rig FILE is missing" in capsys.readouterr().err


def test_a_rig_that_was_lost_is_brought_back(path: Path) -> None:
    path.unlink()
    assert main(["history", "--rig", str(path), "--restore", "1"]) == 0
    assert load_rig(path).name == "two"
