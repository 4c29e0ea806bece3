"""Key files: 0600 from their first moment, refused when wider, and whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import pytest

from rhot_node.errors import TrustError
from rhot_node.keys import (
    MASTERS_MAX,
    KeyPair,
    Master,
    NodeTrust,
    new_key_pair,
    pair_beforehand,
    read_private,
    remove_private,
    write_private,
)


def mode(path: Path) -> int:
    return path.stat().st_mode & 0o777


def test_created_with_0600_and_never_wider(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[int] = []
    make = tempfile.mkstemp

    def watched(*args: object, **kwargs: object) -> tuple[int, str]:
        handle, name = make(*args, **kwargs)  # type: ignore[call-overload]
        seen.append(os.fstat(handle).st_mode & 0o777)
        return handle, name

    monkeypatch.setattr(tempfile, "mkstemp", watched)
    monkeypatch.setattr(Path, "chmod", lambda *_: pytest.fail("nobody changes the mode afterwards"))
    old = os.umask(0)
    try:
        write_private(tmp_path / "keys", b"secret")
        write_private(tmp_path / "keys", b"other")
    finally:
        os.umask(old)
    assert seen == [0o600, 0o600] and mode(tmp_path / "keys") == 0o600
    assert read_private(tmp_path / "keys") == b"other"


@pytest.mark.parametrize("wide", [0o640, 0o604, 0o644, 0o660, 0o601])
def test_a_wider_file_is_refused_with_the_remedy(tmp_path: Path, wide: int) -> None:
    path = tmp_path / "keys"
    write_private(path, b"secret")
    path.chmod(wide)
    with pytest.raises(TrustError, match=f"mode {wide:o}.*chmod 600"):
        read_private(path)


def test_a_link_a_folder_and_anothers_file_are_refused(tmp_path: Path) -> None:
    write_private(tmp_path / "keys", b"secret")
    (tmp_path / "link").symlink_to(tmp_path / "keys")
    for name in ("link", "."):
        with pytest.raises(TrustError):
            read_private(tmp_path / name)
    if os.geteuid() == 0:
        os.chown(tmp_path / "keys", 12345, 12345)
        with pytest.raises(TrustError, match="user 12345"):
            read_private(tmp_path / "keys")
    assert read_private(tmp_path / "none") is None and not remove_private(tmp_path / "none")


@pytest.mark.skipif(os.geteuid() != 0, reason="needs root: files of a service's folder")
def test_root_writes_for_the_owner_of_the_folder(tmp_path: Path) -> None:
    os.chown(tmp_path, 12345, 12346)
    write_private(tmp_path / "keys", b"secret")
    info = (tmp_path / "keys").stat()
    assert (info.st_uid, info.st_gid, info.st_mode & 0o777) == (12345, 12346, 0o600)


def test_a_nodes_keys_stay_and_are_its_own(tmp_path: Path) -> None:
    first = NodeTrust(tmp_path / "left.keys.json")
    assert mode(first.path) == 0o600
    assert NodeTrust(first.path).own == first.own != NodeTrust(tmp_path / "right.keys.json").own
    assert first.own.secret_key not in repr(first.own)


def test_beforehand_pairing_keeps_what_is_there(tmp_path: Path) -> None:
    path, master = tmp_path / "left.keys.json", Master(new_key_pair().public_key, "desk")
    key = pair_beforehand(path, master)
    assert pair_beforehand(path, master) == key and NodeTrust(path).masters == (master,)


def test_no_more_masters_than_a_node_has_room_for(tmp_path: Path) -> None:
    trust = NodeTrust(tmp_path / "left.keys.json")
    for k in range(MASTERS_MAX):
        trust.add(Master(new_key_pair().public_key, f"desk {k}"))
    with pytest.raises(TrustError, match="unpair"):
        trust.add(Master(new_key_pair().public_key, "one more"))
    trust.add(Master(trust.masters[3].public_key, "renamed"))
    assert len(trust.masters) == MASTERS_MAX


def test_broken_files_are_named(tmp_path: Path) -> None:
    path = tmp_path / "left.keys.json"
    NodeTrust(path)
    for data in (b"", b"{}", path.read_bytes()[:80]):
        write_private(path, data)
        with pytest.raises(TrustError, match=r"left\.keys\.json"):
            NodeTrust(path)
    with pytest.raises(ValueError, match="not that of secret_key"):
        KeyPair(new_key_pair().public_key, new_key_pair().secret_key)
