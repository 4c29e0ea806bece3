"""Studies are few, and CONTRIBUTING.md names each with the files that it covers."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from studies import ALL, COLLECTED, changed_since, covers, is_covered, selected

ROOT = Path(__file__).parents[2]
MOST_SHARE = 0.03  # of all tests


@pytest.fixture
def collected(request: pytest.FixtureRequest) -> list[pytest.Item]:
    return request.config.stash[COLLECTED]


def listed() -> dict[str, tuple[str, ...]]:
    """By study, the files that it covers, as CONTRIBUTING.md lists them."""
    rows = re.findall(r"^\| `(test_\w+)` \| (.+) \|$", (ROOT / "CONTRIBUTING.md").read_text(), re.MULTILINE)
    return {name: tuple(re.findall(r"`([^`]+)`", files)) for name, files in rows}


def test_every_study_is_listed(collected: list[pytest.Item]) -> None:
    found = {item.name.partition("[")[0]: paths for item in collected if (paths := covers(item)) is not None}
    missing = {name: paths for name, paths in found.items() if listed().get(name) != paths}
    rows = "\n".join(f"| `{name}` | {', '.join(f'`{path}`' for path in paths)} |" for name, paths in missing.items())
    assert not missing, f"CONTRIBUTING.md, Studies, lacks:\n{rows}"
    if {item.path for item in collected} >= set((ROOT / "tests").rglob("test_*.py")):  # a run of all tests
        assert listed().keys() == found.keys(), "what is listed is marked"
        studies = sum(covers(item) is not None for item in collected)
        assert studies <= MOST_SHARE * len(collected), f"{studies} of {len(collected)} tests are studies"


def test_what_a_study_covers_exists(collected: list[pytest.Item]) -> None:
    paths = {path for item in collected for path in covers(item) or ()}
    paths.update(*listed().values())
    assert not [path for path in sorted(paths) if not (ROOT / path).exists()]


class FakeItem:
    """A test of pytest, marked as a study where `paths` are given."""

    def __init__(self, *paths: str) -> None:
        self.marker = pytest.mark.study(*paths).mark if paths else None

    def get_closest_marker(self, _name: str) -> object:
        return self.marker


def test_the_option_selects_studies(monkeypatch: pytest.MonkeyPatch) -> None:
    test, hand, wire = FakeItem(), FakeItem("rhot_app/hand", "rhot_app/state.py"), FakeItem("rhot_node/wire")
    items: list[object] = [test, hand, wire]
    assert selected(items, None) == [test] and selected(items, ALL) == items  # type: ignore[arg-type]
    monkeypatch.setattr("studies.changed_since", lambda revision: ["README.md", "rhot_app/hand/dh.py"])
    assert selected(items, "HEAD~20") == [test, hand]  # type: ignore[arg-type]
    monkeypatch.setattr("studies.changed_since", lambda revision: None)
    assert selected(items, "HEAD~20") == [test]  # type: ignore[arg-type]
    assert is_covered("rhot_app/state.py", ("rhot_app/state.py",))
    assert not is_covered("rhot_app/handfit/solve.py", ("rhot_app/hand",))


def test_an_unknown_revision_is_no_list_of_changes() -> None:
    assert changed_since("no such revision") is None
