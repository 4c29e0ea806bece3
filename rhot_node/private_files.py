"""Files that hold secrets: created with mode 0600, never wider for a moment, and not read when anybody else could."""

from __future__ import annotations

import os
import secrets
import stat
from pathlib import Path

from rhot_node.errors import TrustError
from rhot_node.files import write_atomically


def read_private(path: Path) -> bytes | None:
    """The bytes of `path`; None when there is no such file.

    Raises TrustError when it is a link, belongs to somebody else, or is open to other users: what it says may be known
    to them, or be theirs.
    """
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK)
    except FileNotFoundError:
        return None
    except OSError as exc:
        raise TrustError(f"{path}: cannot be read ({exc.strerror}; a link is not followed).") from exc
    try:
        _check_owner_and_mode(path, os.fstat(handle))
    except TrustError:
        os.close(handle)
        raise
    with os.fdopen(handle, "rb") as file:
        return file.read()


def _check_owner_and_mode(path: Path, info: os.stat_result) -> None:
    if not stat.S_ISREG(info.st_mode):
        raise TrustError(f"{path}: is not a file.")
    if info.st_uid not in (os.geteuid(), 0):
        raise TrustError(f"{path}: belongs to user {info.st_uid}, not to you. It holds secret keys, which only their "
                         "owner may choose; remove it, or run this as its owner.")
    if info.st_mode & 0o077:
        raise TrustError(f"{path}: is open to other users (mode {info.st_mode & 0o777:o}), but holds secret keys. If "
                         f"nobody can have read it, run `chmod 600 {path}`; otherwise remove it and pair again.")


def write_private(path: Path, data: bytes) -> None:
    """Write `data` atomically, readable by its owner only; root writes for the owner of the folder, so that ``sudo``
    leaves nothing that a service cannot read. Raises TrustError."""
    try:
        write_atomically(path, data, private=True)
    except OSError as exc:
        raise TrustError(f"{path}: cannot be written ({exc.strerror}).") from exc


def create_private(path: Path, data: bytes) -> bool:
    """Write `data` as `write_private` does unless `path` is there already; returns whether it was written. Of several
    programs that do so at once, one does. Raises TrustError."""
    fresh = path.with_name(f".{path.name}.{secrets.token_hex(8)}")
    write_private(fresh, data)
    try:
        os.link(fresh, path)  # unlike a rename, never over what is there
    except FileExistsError:
        return False
    except OSError as exc:
        raise TrustError(f"{path}: cannot be written ({exc.strerror}).") from exc
    finally:
        fresh.unlink()
    return True


def remove_private(path: Path) -> bool:
    """Remove `path`; False when there was none. Raises TrustError."""
    try:
        path.unlink()
    except FileNotFoundError:
        return False
    except OSError as exc:
        raise TrustError(f"{path}: cannot be removed ({exc.strerror}).") from exc
    return True
