"""All kinds of observations: those that nodes send, and pictures of files."""

from __future__ import annotations

from rhot_app.tracking.kinds.edges import EdgeKind
from rhot_app.tracking.kinds.kind import Kind
from rhot_app.tracking.kinds.landmarks import LandmarkKind
from rhot_app.tracking.kinds.markers import MarkerKind
from rhot_app.tracking.kinds.tags import TagKind
from rhot_app.tracking.kinds.templates import TemplateKind

KINDS: list[type[Kind]] = [MarkerKind, LandmarkKind, EdgeKind, TagKind, TemplateKind]


def register(kind: type[Kind]) -> None:
    """Add a kind of another package. Validators that are made from now on ask it before those that are there.

    Raises TypeError when it does not say its name or its messages."""
    for told in ("name", "messages"):
        if not getattr(kind, told, None):
            raise TypeError(f"{kind.__qualname__}: a kind of observations needs `{told}`.")
    KINDS.append(kind)
