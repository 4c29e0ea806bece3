"""Look for nodes, ask those at given addresses who they are, and make a first rig of those that answer."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec

from rhot_app.errors import SourceError
from rhot_app.keys import load_master_keys
from rhot_app.progress import Progress
from rhot_app.project import Rig, RigNode, load_rig
from rhot_app.sources.discovery import Search, find_nodes
from rhot_app.sources.pairing import TIMEOUT_S, Introduction, NodeAddress, ask_who, pair
from rhot_app.ui.language import tr
from rhot_node.files import resource_path


@dataclass(frozen=True, slots=True)
class NodeAnswer:
    """Who a node said it is; `error` is a sentence when it did not answer. `paired`: with this computer."""

    address: NodeAddress
    who: Introduction | None = None
    paired: bool = False
    error: str = ""

    @property
    def found(self) -> bool:
        """Whether a node answered."""
        return self.who is not None

    @property
    def usable(self) -> bool:
        """Whether the node will do what this computer says."""
        return self.who is not None and (self.paired or self.who.trust == "open")

    @property
    def text(self) -> str:
        """The answer in a sentence or two."""
        if self.who is None:
            return self.error
        begin = tr("{name} (id {node_id}) answers; it is {state}.", name=self.who.name, node_id=self.who.node_id,
                   state=tr(self.who.state))
        if self.paired:
            return tr("{begin} Paired with this computer.", begin=begin)
        if self.who.trust == "open":
            return tr("{begin} Open: anybody on the network may see its pictures and steer it.", begin=begin)
        return tr("{begin} Not paired with this computer: press Pair.", begin=begin)


def look_for_nodes(progress: Progress) -> Search:
    """Who is on the network. Waits, so call it in a worker."""
    return find_nodes(progress=progress)


def ask_nodes(addresses: list[NodeAddress], timeout_s: float = TIMEOUT_S) -> list[NodeAnswer]:
    """Ask every address at once; returns after the last answer or `timeout_s`. Waits, so call it in a worker. Raises
    TrustError when this computer's keys cannot be read."""
    keys = load_master_keys()
    return [NodeAnswer(address, error=who) if isinstance(who, str)
            else NodeAnswer(address, who, keys.knows(who.public_key))
            for address, who in zip(addresses, ask_who(addresses, timeout_s), strict=True)]


def pair_node(address: NodeAddress, code: str) -> str:
    """Pair with a node by its code; returns its name. Waits. Raises PairingError, TrustError."""
    return pair(address, code, load_master_keys()).name


def first_rig(answers: list[NodeAnswer]) -> Rig:
    """The shipped rig for two Pis with the two nodes that answered in place of its own, left one first.

    Lenses and positions are the shipped rig's until a calibration replaces them. Raises SourceError when there are
    not two that this computer may use, or when both have the same id.
    """
    usable = [answer for answer in answers if answer.usable]
    if len(usable) != 2:
        raise SourceError(tr("A rig needs two nodes that answer and are paired with this computer."))
    ids = [answer.who.node_id for answer in usable if answer.who is not None]
    if ids[0] == ids[1]:
        raise SourceError(tr("Both nodes have the id {node_id}; give one another node_id in its settings file.",
                             node_id=ids[0]))
    template = load_rig(resource_path("rigs", "two_pis.json"))
    nodes = tuple(_with_address(node, answer) for node, answer in zip(template.nodes, usable, strict=True))
    return msgspec.structs.replace(template, nodes=nodes)


def _with_address(node: RigNode, answer: NodeAnswer) -> RigNode:
    who = answer.who
    assert who is not None  # it is usable
    return msgspec.structs.replace(
        node, node_id=who.node_id, address=answer.address.host, udp_port=who.udp_port, control_port=who.control_port,
        preview_port=who.preview_port, pairing_port=answer.address.pairing_port, public_key=who.public_key)
