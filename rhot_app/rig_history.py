"""Earlier versions of a rig or hand file: kept when another is accepted, so that what was there can be brought back.

They lie beside the file in ``NAME.history/``, one whole file per version, oldest first by name.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from rhot_app.errors import RigError
from rhot_app.hand.anatomy import FORMAT, HandAnatomy, load_hand, save_hand
from rhot_app.project import Rig, load_rig, save_rig
from rhot_node.files import read_input, read_json, require_replaceable, why

KEPT = 50  # versions; the oldest go first

RESTORING = "restoring"
"""First word of the reason of every restore."""

_NAME = re.compile(r"^(\d{8}T\d{6}\d{6}Z)-(.*)\.json$")
_STAMP = "%Y%m%dT%H%M%S%fZ"


@dataclass(frozen=True, slots=True)
class Version:
    """One earlier state of a rig file: where it is kept, when it was replaced and by what."""

    path: Path
    replaced_at: datetime
    replaced_by: str


def accept(path: Path, rig: Rig, reason: str) -> Version | None:
    """Write `rig` to `path` and keep what was there; `reason` names the calibration ("stereo calibration").

    Returns the kept version, None when `path` did not exist or already said the same. Raises RigError when the folder
    cannot be written; the rig file is then as it was.
    """
    return _accept(path, reason, lambda: load_rig(path) == rig, lambda: save_rig(path, rig))


def accept_hand(path: Path, hand: HandAnatomy, reason: str) -> Version | None:
    """The same of a hand file."""
    return _accept(path, reason, lambda: load_hand(path) == hand, lambda: save_hand(path, hand))


def require_hand_place(path: Path) -> None:
    """Raises RigError unless a hand file can be written to `path`: its folder is there, and nothing else than a hand
    file, which a person may have broken, stands there already."""
    if not path.absolute().parent.is_dir():
        raise RigError(f"{path}: the folder {path.parent} does not exist; create it first.")
    try:
        require_replaceable(path)
    except (OSError, ValueError) as exc:
        raise RigError(f"{path}: cannot be written ({why(exc)}).") from exc
    if not path.exists():
        return
    try:
        document = read_json(path, RigError)
    except RigError as exc:
        raise RigError(f"{exc} It is no hand file and stays as it is; name another file for the hand.") from exc
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise RigError(f"{path}: it is there already, is no hand file ({FORMAT}), and stays as it is; name another "
                       "file for the hand.")


def _accept(path: Path, reason: str, same: Callable[[], bool], save: Callable[[], None]) -> Version | None:
    try:
        require_replaceable(path)
        if not path.exists():
            save()
            return None
        if _holds(same):
            return None
        kept = _keep(path, reason)
        save()
    except OSError as exc:
        raise RigError(f"{path}: cannot be written ({exc.strerror}); nothing was changed.") from exc
    return kept


def versions(path: Path) -> list[Version]:
    """What can be brought back, newest first."""
    found = []
    for file in sorted(_folder(path).glob("*.json"), reverse=True):
        match = _NAME.match(file.name)
        if match:
            when = datetime.strptime(match[1], _STAMP).replace(tzinfo=UTC)
            found.append(Version(file, when, match[2].replace("-", " ")))
    return found


def restore(path: Path, version: Version) -> Rig:
    """Bring `version` back to `path`; what was there is kept as a version itself. Returns the rig that is now there.

    Raises RigError when the version cannot be read or the rig not written.
    """
    rig = load_version(path, version)
    accept(path, rig, f"{RESTORING} an earlier version")
    return rig


def load_version(path: Path, version: Version) -> Rig:
    """The rig of a kept version of `path`, whose objects lie where those of `path` do. Raises RigError."""
    return load_rig(version.path, path.absolute().parent)


def in_force(path: Path) -> dict[str, datetime]:
    """Time of the last calibration by its reason, as far as it is still in force: one that a restore took away is not,
    and one that a restore brought back is. Empty for a rig file without a history."""
    kept = list(reversed(versions(path)))  # oldest first; each file is the state before its event
    texts = [_text(version.path) for version in kept] + [_text(path)]
    states: list[dict[str, datetime]] = [{}]
    for number, version in enumerate(kept):
        after = texts[number + 1]
        if version.replaced_by.startswith(RESTORING):
            earlier = [k for k in range(number + 1) if texts[k] == after]
            states.append(dict(states[earlier[-1]]) if earlier else {})
        else:
            states.append({**states[-1], version.replaced_by: version.replaced_at})
    return states[-1]


def _text(path: Path) -> bytes:
    try:
        return read_input(path)
    except OSError:
        return b""


def _folder(path: Path) -> Path:
    return path.with_name(f"{path.name}.history")


def _holds(same: Callable[[], bool]) -> bool:
    try:
        return same()
    except RigError:
        return False  # what a person broke by hand is worth keeping too


def _keep(path: Path, reason: str) -> Version:
    folder = _folder(path)
    folder.mkdir(exist_ok=True)
    now = datetime.now(UTC)
    words = re.sub(r"[^a-z0-9]+", "-", reason.lower()).strip("-") or "change"
    target = folder / f"{now.strftime(_STAMP)}-{words}.json"
    shutil.copy2(path, target)
    for old in versions(path)[KEPT:]:
        old.path.unlink(missing_ok=True)
    return Version(target, now, words.replace("-", " "))
