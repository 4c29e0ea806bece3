"""Keys of actions: what can be chosen and taken away, and what stored keys give way to."""

from __future__ import annotations

import pytest
from PySide6.QtGui import QAction, QKeySequence

from rhot_app.ui.common.keys import ActionKeys
from rhot_app.ui.common.settings import Settings


@pytest.fixture
def keys_with(themed, tmp_path):
    """A function that makes the keys of one action, "guide" with F1, beside menus of these texts."""
    def make(*menus: str) -> ActionKeys:
        guide = QAction("Guide")
        guide.setObjectName("guide")
        guide.setShortcut("F1")
        make.kept = [guide, *map(QAction, menus)]
        return ActionKeys(make.kept[:1], Settings(tmp_path / "app.ini"), make.kept[1:])

    return make


def test_a_key_is_taken_away_also_beside_a_menu_without_a_letter(keys_with):
    keys = keys_with("Rig", "&View")
    guide = keys.named("guide")
    assert keys.choose(guide, QKeySequence()) == "" and guide.shortcut().isEmpty()
    assert "View" in keys.choose(guide, QKeySequence("Alt+V"))


@pytest.mark.parametrize(("stored", "menus", "key"), [
    ("Alt+A", ("&View",), "Alt+A"), ("Alt+A", ("&Ansicht",), "F1"), ("Space", (), "F1"), ("", ("Rig",), "")])
def test_a_stored_key_gives_way_to_the_letters_of_the_language(keys_with, tmp_path, stored, menus, key):
    Settings(tmp_path / "app.ini").set_key("guide", stored)
    keys = keys_with(*menus)
    assert keys.named("guide").shortcut().toString() == key
    assert Settings(tmp_path / "app.ini").key("guide") == stored, "it returns with the other language"
