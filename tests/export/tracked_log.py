"""The states of a whole log."""

from __future__ import annotations

from pathlib import Path

from rhot_app.export.recording import TrackedLog
from rhot_app.export.states import HandStates, joined


def states_of_log(path: Path, tracker: str = "classic", *, smooth: bool = False) -> HandStates:
    with TrackedLog(path, tracker=tracker, smooth=smooth) as tracked:
        return joined(list(tracked.blocks()))
