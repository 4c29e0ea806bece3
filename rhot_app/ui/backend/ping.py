"""Ask nodes at given addresses whether they are there, and make a first rig of those that answer."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import zmq

from rhot_app.errors import SourceError
from rhot_app.project import Rig, RigNode, load_rig
from rhot_node.files import resource_path

PING_TIMEOUT_S = 2.0


@dataclass(frozen=True, slots=True)
class NodeAddress:
    """Where to ask."""

    host: str
    control_port: int


@dataclass(frozen=True, slots=True)
class NodeAnswer:
    """What a node said about itself; `error` is a sentence when it did not answer."""

    address: NodeAddress
    node_id: int = 0
    name: str = ""
    state: str = ""
    error: str = ""

    @property
    def found(self) -> bool:
        """Whether a node answered."""
        return not self.error


def ask_nodes(addresses: list[NodeAddress], timeout_s: float = PING_TIMEOUT_S) -> list[NodeAnswer]:
    """Ask every address at once; returns after the last answer or `timeout_s`. Waits, so call it in a worker."""
    context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
    poller = zmq.Poller()
    sockets: list[zmq.Socket[bytes]] = []
    answers: list[NodeAnswer | None] = []
    try:
        for address in addresses:
            socket = context.socket(zmq.REQ)
            socket.setsockopt(zmq.LINGER, 0)
            sockets.append(socket)
            answers.append(_send_question(socket, address))
            if answers[-1] is None:
                poller.register(socket, zmq.POLLIN)
        remaining = timeout_s
        while any(answer is None for answer in answers) and remaining > 0:
            ready = dict(poller.poll(50))
            remaining -= 0.05 if not ready else 0.0
            for k, socket in enumerate(sockets):
                if socket in ready:
                    answers[k] = _read_answer(addresses[k], socket.recv_multipart()[0])
                    poller.unregister(socket)
    finally:
        context.destroy(0)
    silence = f"nothing answered within {timeout_s:g} s. Is rhot-node running there, and the address right?"
    return [answer if answer is not None else NodeAnswer(address, error=f"{address.host}: {silence}")
            for address, answer in zip(addresses, answers, strict=True)]


def _send_question(socket: zmq.Socket[bytes], address: NodeAddress) -> NodeAnswer | None:
    try:
        socket.connect(f"tcp://{address.host}:{address.control_port}")
        socket.send(b'{"request": "state"}')
    except zmq.ZMQError as exc:
        return NodeAnswer(address, error=f"{address.host!r} is not an address that can be asked ({exc}).")
    return None


def _read_answer(address: NodeAddress, data: bytes) -> NodeAnswer:
    try:
        fields = msgspec.json.decode(data, type=dict[str, object])
        node_id, name, state = fields["node_id"], fields["name"], fields["state"]
    except (msgspec.MsgspecError, KeyError):
        return NodeAnswer(address, error=f"{address.host}: something answered that is not a node of this system.")
    if not isinstance(node_id, int):
        return NodeAnswer(address, error=f"{address.host}: the node's id is not a number.")
    return NodeAnswer(address, node_id, str(name), str(state))


def first_rig(answers: list[NodeAnswer]) -> Rig:
    """The shipped rig for two Pis with the two nodes that answered in place of its own, left one first.

    Lenses and positions are the shipped rig's until a calibration replaces them. Raises SourceError when there are
    not two, or when both have the same id or name.
    """
    found = [answer for answer in answers if answer.found]
    if len(found) != 2:
        raise SourceError("A rig needs two nodes that answer.")
    if found[0].node_id == found[1].node_id:
        raise SourceError(f"Both nodes have the id {found[0].node_id}; give one another node_id in its settings file.")
    template = load_rig(resource_path("rigs", "two_pis.json"))
    nodes = tuple(_with_address(node, answer) for node, answer in zip(template.nodes, found, strict=True))
    return msgspec.structs.replace(template, nodes=nodes)


def _with_address(node: RigNode, answer: NodeAnswer) -> RigNode:
    return msgspec.structs.replace(node, node_id=answer.node_id, address=answer.address.host,
                                   control_port=answer.address.control_port)
