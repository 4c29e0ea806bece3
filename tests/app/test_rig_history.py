"""Earlier versions of a rig file."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
from shipped_rig import TWO_PIS

from rhot_app import rig_history
from rhot_app.errors import RigError
from rhot_app.project import Rig, load_rig


def named(name: str) -> Rig:
    return msgspec.structs.replace(TWO_PIS, name=name)


def test_what_was_there_can_be_brought_back(tmp_path: Path) -> None:
    path = tmp_path / "desk.json"
    assert rig_history.accept(path, named("one"), "setting up") is None
    rig_history.accept(path, named("two"), "Stereo calibration")
    (kept,) = rig_history.versions(path)
    assert kept.replaced_by == "stereo calibration"
    assert load_rig(kept.path).name == "one"
    assert rig_history.restore(path, kept).name == "one"
    assert load_rig(path).name == "one"
    assert load_rig(rig_history.versions(path)[0].path).name == "two"  # restoring can be undone as well


def test_the_same_rig_makes_no_version(tmp_path: Path) -> None:
    path = tmp_path / "desk.json"
    rig_history.accept(path, TWO_PIS, "a")
    assert rig_history.accept(path, TWO_PIS, "b") is None
    assert rig_history.versions(path) == []


def test_versions_are_newest_first_and_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rig_history, "KEPT", 3)
    path = tmp_path / "desk.json"
    for number in range(6):
        rig_history.accept(path, named(f"rig {number}"), f"change {number}")
    names = [load_rig(version.path).name for version in rig_history.versions(path)]
    assert names == ["rig 4", "rig 3", "rig 2"]


def test_a_rig_broken_by_hand_is_kept_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "desk.json"
    path.write_text("{ broken")
    kept = rig_history.accept(path, TWO_PIS, "repair")
    assert kept is not None
    assert kept.path.read_text() == "{ broken"


def test_a_folder_that_cannot_be_written_changes_nothing(tmp_path: Path) -> None:
    path = tmp_path / "desk.json"
    rig_history.accept(path, TWO_PIS, "first")
    path.with_name("desk.json.history").write_text("a file where the folder should be")
    with pytest.raises(RigError, match="nothing was changed"):
        rig_history.accept(path, named("two"), "second")
    assert load_rig(path) == TWO_PIS
