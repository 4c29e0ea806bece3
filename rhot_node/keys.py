"""CURVE key pairs, and their spelling in files: 64 hexadecimal digits. No files and no sockets of its own here."""

from __future__ import annotations

from typing import Annotated

import msgspec
import zmq
from msgspec import Meta
from zmq.utils import z85

from rhot_node.files import PRINTABLE

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
