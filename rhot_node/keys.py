"""CURVE key pairs, and their spelling in files: 64 hexadecimal digits. No files and no sockets of its own here."""

from __future__ import annotations

import logging
import os
import secrets
import stat
from pathlib import Path
from typing import Annotated, Any, Final, Literal, TypeVar

import msgspec
import zmq
from msgspec import Meta
from zmq.utils import z85

from rhot_node.errors import TrustError
from rhot_node.files import PRINTABLE, decode_document, encode_document, write_atomically
from rhot_node.wire.messages import TrustState

T = TypeVar("T")

HexKey = Annotated[str, Meta(pattern=r"\A[0-9a-f]{64}\Z")]
Name = Annotated[str, Meta(min_length=1, max_length=64, pattern=PRINTABLE)]


class KeyPair(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A CURVE (X25519) key pair. Its secret half shows in no log: `repr` leaves it out."""

    public_key: HexKey
    secret_key: HexKey

    def __post_init__(self) -> None:
        if zmq.curve_public(z85.encode(bytes.fromhex(self.secret_key))) != z85.encode(bytes.fromhex(self.public_key)):
            raise ValueError("public_key is not that of secret_key")

    def __repr__(self) -> str:
        return f"KeyPair({self.public_key})"


def new_key_pair() -> KeyPair:
    """A fresh pair from the system's random source."""
    public, secret = zmq.curve_keypair()
    return KeyPair(z85.decode(public).hex(), z85.decode(secret).hex())


def serve_with(sock: zmq.Socket[bytes], own: KeyPair) -> None:
    """Make `sock` a CURVE server. Who gets in is for a `Gate` to say: CURVE alone admits all who know its key."""
    sock.curve_server = True
    sock.curve_secretkey = z85.encode(bytes.fromhex(own.secret_key))


def connect_with(sock: zmq.Socket[bytes], own: KeyPair, server_key: str) -> None:
    """Make `sock` a CURVE client that talks to the holder of `server_key` (64 hexadecimal digits) and nobody else."""
    sock.curve_publickey = z85.encode(bytes.fromhex(own.public_key))
    sock.curve_secretkey = z85.encode(bytes.fromhex(own.secret_key))
    sock.curve_serverkey = z85.encode(bytes.fromhex(server_key))


# -- files of secrets --------------------------------------------------------------------------------------------------
# Created with mode 0600, and not read when anybody else may read them.

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
    if info.st_mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise TrustError(f"{path}: is open to other users (mode {info.st_mode & 0o777:o}), but holds secret keys. If "
                         f"nobody can have read it, run `chmod 600 {path}`; otherwise remove it and pair again.")


def write_private(path: Path, data: bytes) -> None:
    """Write `data` atomically, readable by its owner only; root writes for the owner of the folder, so that ``sudo``
    leaves nothing that a service cannot read. Raises TrustError."""
    try:
        write_atomically(path, data, private=True)
    except OSError as exc:
        raise TrustError(f"{path}: cannot be written ({exc.strerror}).") from exc


def read_private_document(path: Path, kind: type[T], format_name: str, version: int) -> T | None:
    """The document of a file of secrets; None when there is none. Raises TrustError."""
    data = read_private(path)
    return None if data is None else decode_document(data, kind, format_name=format_name, version=version,
                                                     where=str(path), error=TrustError)


def write_private_document(path: Path, document: Any) -> None:
    """Write a document as `write_private` does."""
    write_private(path, encode_document(document))


def create_private_document(path: Path, document: Any) -> bool:
    """Write `document` unless `path` is there already; returns whether it was written. Of several programs that do so
    at once, one does. Raises TrustError."""
    fresh = path.with_name(f".{path.name}.{secrets.token_hex(8)}")
    write_private_document(fresh, document)
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


# -- key pair and paired masters ---------------------------------------------------------------------------------------
# `rhot-node unpair` removes the file; a running node notices, draws a new pair and forgets every master.

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
        self._keys = self._read() or self._draw()
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
        write_private_document(self.path, keys)
        self._keys, self._seen = keys, self._look()
        log.info("paired with %r, key %s", master.name, master.public_key)

    def refresh(self) -> bool:
        """Take up a file that was removed or changed since; True when it was. What cannot be read lets nobody in."""
        if self._look() == self._seen:
            return False
        try:
            self._keys = self._read() or self._draw()
        except TrustError as exc:
            log.error("%s Nobody is let in until this is mended.", exc)
            self._keys = NodeKeys(new_key_pair())
        self._seen = self._look()
        return True

    def _read(self) -> NodeKeys | None:
        return read_private_document(self.path, NodeKeys, FORMAT, VERSION)

    def _draw(self) -> NodeKeys:
        keys = NodeKeys(new_key_pair())
        write_private_document(self.path, keys)
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

