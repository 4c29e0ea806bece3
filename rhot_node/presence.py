"""What a node tells anybody of itself, so that it can be found: by zeroconf, and in answer to a question by UDP."""

from __future__ import annotations

from dataclasses import dataclass

from rhot_node.wire.messages import Find, Here, NodeState, TrustState


@dataclass(frozen=True, slots=True)
class Presence:
    """Who is there. Nobody has to believe it: whether it is true shows when the node proves its key."""

    node_id: int
    boot_id: int
    name: str
    udp_port: int
    control_port: int
    preview_port: int
    pairing_port: int
    trust: TrustState

    def answer(self, question: Find, state: NodeState) -> Here:
        """The answer of a node in this state."""
        return Here(self.node_id, question.sequence, question.nonce, self.boot_id, self.udp_port, self.control_port,
                    self.preview_port, self.pairing_port, state, self.trust, self.name)
