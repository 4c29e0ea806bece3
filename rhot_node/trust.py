"""Whom a node trusts: its own key pair and the masters it is paired with, in one file of mode 0600 beside its settings.

`rhot-node unpair` removes the file; a running node notices, draws a new pair and forgets every master.
"""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Final, Literal

import msgspec

from rhot_node.errors import TrustError
from rhot_node.files import decode_document
from rhot_node.keys import HexKey, KeyPair, Name, new_key_pair
from rhot_node.private_files import read_private, write_private
from rhot_node.wire.messages import TrustState

log = logging.getLogger(__name__)

FORMAT: Final = "rhot-node-keys"
VERSION: Final = 1
MASTERS_MAX = 16


class Master(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A master that may do everything with this node."""

    public_key: HexKey
    name: Name


class NodeKeys(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The content of the file."""

    own: KeyPair
    masters: tuple[Master, ...] = ()
    format: Literal["rhot-node-keys"] = FORMAT
    version: Literal[1] = VERSION


def keys_path(settings: Path) -> Path:
    """Where the keys of the node with this settings file lie."""
    return settings.with_name(f"{settings.stem}.keys.json")


class NodeTrust:
    """The keys in force. One thread at a time; `refresh` looks whether the file was changed from outside."""

    def __init__(self, path: Path) -> None:
        """Read the file, or draw a key pair and write it. Raises TrustError when it is open to others or broken."""
        self.path = path
        self._keys = _read(path) or self._draw()
        self._seen = self._look()

    @property
    def own(self) -> KeyPair:
        """The node's own keys."""
        return self._keys.own

    @property
    def masters(self) -> tuple[Master, ...]:
        """The masters that are let in."""
        return self._keys.masters

    def admits(self, public_key: str) -> bool:
        """Whether the holder of this key is one of the masters."""
        return any(master.public_key == public_key for master in self._keys.masters)

    def add(self, master: Master) -> None:
        """Let `master` in from now on. Raises TrustError when that cannot be written down; nothing changed then."""
        others = tuple(one for one in self._keys.masters if one.public_key != master.public_key)
        if len(others) >= MASTERS_MAX:
            raise TrustError(f"{MASTERS_MAX} masters are paired already; `rhot-node unpair` forgets them all.")
        keys = msgspec.structs.replace(self._keys, masters=(*others, master))
        _write(self.path, keys)
        self._keys, self._seen = keys, self._look()
        log.info("paired with %r, key %s", master.name, master.public_key)

    def refresh(self) -> bool:
        """Take up a file that was removed or changed since; True when it was. What cannot be read lets nobody in."""
        if self._look() == self._seen:
            return False
        try:
            self._keys = _read(self.path) or self._draw()
        except TrustError as exc:
            log.error("%s Nobody is let in until this is mended.", exc)
            self._keys = NodeKeys(new_key_pair())
        self._seen = self._look()
        return True

    def _draw(self) -> NodeKeys:
        keys = NodeKeys(new_key_pair())
        _write(self.path, keys)
        return keys

    def _look(self) -> tuple[int, int] | None:
        try:
            info = self.path.lstat()
        except OSError:
            return None
        return info.st_ino, info.st_mtime_ns


def trust_state(trust: NodeTrust | None) -> TrustState:
    """Whom a node with these keys answers; None: it is open."""
    if trust is None:
        return TrustState.OPEN
    return TrustState.PAIRED if trust.masters else TrustState.UNPAIRED


def pair_beforehand(path: Path, master: Master) -> str:
    """Write a node's key file that lets `master` in, before the node is started; returns the node's public key.

    For nodes that a master starts itself, in a folder that is its own. Keys that are there stay. Raises TrustError.
    """
    trust = NodeTrust(path)
    if not trust.admits(master.public_key):
        trust.add(master)
    return trust.own.public_key


def _read(path: Path) -> NodeKeys | None:
    data = read_private(path)
    return None if data is None else decode_document(data, NodeKeys, format_name=FORMAT, version=VERSION,
                                                     where=str(path), error=TrustError)


def _write(path: Path, keys: NodeKeys) -> None:
    write_private(path, msgspec.json.format(msgspec.json.encode(keys), indent=2) + b"\n")
