"""Articulated objects that ship, or are written for a test, compiled."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rhot_app.articulated.bodies import Bodies, bodies_of
from rhot_app.hand.articulated import load_articulated
from rhot_app.hand.articulated_model import ArticulatedModel, build_articulated
from rhot_node.files import resource_path


def object_of(what: str | dict[str, Any],
              folder: Path | None = None) -> tuple[ArticulatedModel, Bodies, tuple[str, ...]]:
    """The model, bodies and layer names of a shipped object, or of a document that is written to `folder`."""
    path = resource_path("articulated", f"{what}.json")
    if isinstance(what, dict):
        assert folder is not None
        path = folder / "object.json"
        path.write_text(json.dumps(what))
    model = build_articulated(load_articulated(path))
    return model, *bodies_of(model)


def box_on_hinge() -> tuple[ArticulatedModel, Bodies, tuple[str, ...]]:
    return object_of("hinged_box")
