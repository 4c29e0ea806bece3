"""Which calibrations are in force for a rig file, and since when: read out of the file's history."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from pathlib import Path

from rhot_app import rig_history
from rhot_app.ui.wizards.models.proposal import RESTORING


def in_force(path: Path) -> dict[str, datetime]:
    """Time of the last calibration by its reason, as far as it is still in force: one that a restore took away is not,
    and one that a restore brought back is. Empty for a rig file without a history."""
    versions = list(reversed(rig_history.versions(path)))  # oldest first; each file is the state before its event
    texts = [_text(version.path) for version in versions] + [_text(path)]
    states: list[dict[str, datetime]] = [{}]
    for number, version in enumerate(versions):
        after = texts[number + 1]
        if version.replaced_by.startswith(RESTORING):
            earlier = [k for k in range(number + 1) if texts[k] == after]
            states.append(dict(states[earlier[-1]]) if earlier else {})
        else:
            states.append({**states[-1], version.replaced_by: version.replaced_at})
    return states[-1]


def age_text(when: datetime, now: datetime | None = None) -> str:
    """How long ago in words: "today", "yesterday", "5 days ago", "3 months ago"."""
    days = ((now or datetime.now(UTC)).astimezone().date() - when.astimezone().date()) // timedelta(days=1)
    if days <= 0:
        return "today"
    if days == 1:
        return "yesterday"
    if days < 60:
        return f"{days} days ago"
    return f"{days // 30} months ago"


def _text(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:
        return b""
