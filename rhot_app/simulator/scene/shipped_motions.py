"""The motions of resources/motions, as lists and menus name them."""

from __future__ import annotations

from dataclasses import dataclass

from rhot_app.errors import RigError
from rhot_node.files import read_json, resource_path


@dataclass(frozen=True, slots=True)
class MotionInfo:
    """Name as the simulator takes it, and what the hand does."""

    name: str
    description: str


def shipped_motions() -> list[MotionInfo]:
    """All motions of resources/motions, by name; one that cannot be read is left out."""
    found = []
    for path in sorted(resource_path("motions").glob("*.json")):
        try:
            document = read_json(path, RigError)
        except RigError:
            continue
        found.append(MotionInfo(path.stem, str(document.get("description", ""))))
    return found
