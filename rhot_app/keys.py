"""The master's own keys and the nodes it was paired with: one file of mode 0600 in the user's configuration folder.

The rig file says which key each of its nodes has (`public_key`); what is remembered here lets a new rig be written.
"""

from __future__ import annotations

import os
import socket
from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta
from platformdirs import user_config_path

from rhot_node.errors import TrustError
from rhot_node.keys import (
    HexKey,
    KeyPair,
    Master,
    Name,
    create_private_document,
    new_key_pair,
    read_private_document,
    write_private_document,
)

FORMAT: Final = "rhot-master-keys"
VERSION: Final = 1
PLACE_VARIABLE = "RHOT_KEYS"
"""Environment variable that names another file."""


class KnownNode(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A node that has proved its key once."""

    public_key: HexKey
    node_id: Annotated[int, Meta(ge=1, le=2**32 - 1)]
    name: Name


class MasterKeys(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The content of the file."""

    own: KeyPair
    nodes: tuple[KnownNode, ...] = ()
    format: Literal["rhot-master-keys"] = FORMAT
    version: Literal[1] = VERSION

    @property
    def me(self) -> Master:
        """This master as a node knows it."""
        return Master(self.own.public_key, socket.gethostname()[:64] or "master")

    def knows(self, public_key: str) -> bool:
        """Whether a node proved this key."""
        return any(node.public_key == public_key for node in self.nodes)


def keys_path() -> Path:
    """Where the file is: ``~/.config/rhot/keys.json``, or where RHOT_KEYS says."""
    chosen = os.environ.get(PLACE_VARIABLE)
    return Path(chosen) if chosen else user_config_path("rhot") / "keys.json"


def load_master_keys(path: Path | None = None) -> MasterKeys:
    """The keys; drawn and written when there are none. Raises TrustError when the file is open to others or broken."""
    place = path or keys_path()
    keys = read_private_document(place, MasterKeys, FORMAT, VERSION)
    if keys is not None:
        return keys
    try:
        place.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as exc:
        raise TrustError(f"{place.parent}: cannot be made ({exc.strerror}); {PLACE_VARIABLE} may name another file for "
                         "the keys.") from exc
    create_private_document(place, MasterKeys(new_key_pair()))  # of two programs that start at once one draws
    keys = read_private_document(place, MasterKeys, FORMAT, VERSION)
    if keys is None:
        raise TrustError(f"{place}: vanished while it was being made.")
    return keys


def remember_node(node: KnownNode, path: Path | None = None) -> None:
    """Note a node that was paired. Raises TrustError."""
    place = path or keys_path()
    keys = load_master_keys(place)
    others = tuple(one for one in keys.nodes if one.public_key != node.public_key)
    write_private_document(place, msgspec.structs.replace(keys, nodes=(*others, node)))
