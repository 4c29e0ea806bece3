"""Where frames come from: live nodes or a log, the same to the engine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from rhot_app.barehand.observations import SliceRequest
from rhot_app.project import Rig
from rhot_app.recording.raw_log import RecordSink
from rhot_app.sources.node_link import NodeLink
from rhot_app.sources.receiver import Deliver, NodeReceiver


class ObservationSource(Protocol):
    """Delivers verified frames of all cameras of a rig from threads of its own."""

    def deliver_to(self, deliver: Deliver) -> None:
        """Hand frames to `deliver` from now on, possibly from several threads at once; before, they go nowhere."""
        ...

    @property
    def links(self) -> Sequence[NodeLink]:
        """What is known of each node, in the order of the rig's nodes."""
        ...

    @property
    def receivers(self) -> Sequence[NodeReceiver]:
        """Likewise; none in a replay."""
        ...

    @property
    def live(self) -> bool:
        """Whether receive times are of this moment, so that latency means something."""
        ...

    @property
    def log_path(self) -> str:
        """The log that is replayed, "" of live nodes."""
        ...

    @property
    def changes(self) -> int:
        """Grows whenever a node's clock was set or a session began: the tracker must then forget."""
        ...

    def notices(self) -> list[str]:
        """Sentences about the source itself, such as the end of a log."""
        ...

    def configure(self, rig: Rig) -> None:
        """Go on with another rig whose nodes are reached the same way (`same_network`)."""
        ...

    def start(self, session: int) -> None:
        """Have the nodes stream in `session` (not 0)."""
        ...

    def stop(self) -> None:
        """Have the nodes stop."""
        ...

    def search(self, request: SliceRequest) -> None:
        """Ask a node to search its next frames; a log answers what it was asked when it was recorded."""
        ...

    def record_to(self, tap: RecordSink | None) -> None:
        """Hand every datagram and clock exchange to `tap` from now on, beginning with what a replay needs to know."""
        ...

    def close(self) -> None:
        """End all threads and close all ports. May be called twice."""
        ...


def same_network(one: Rig, other: Rig) -> bool:
    """Whether both rigs reach the same nodes and other trackers in the same way, so that nothing is opened anew."""
    def network(rig: Rig) -> list[tuple[object, ...]]:
        return [(rig.broadcast.address, rig.broadcast.port),
                *((one.model.name, one.poses) for one in rig.objects if one.model is not None and one.poses),
                *((node.node_id, node.address, node.udp_port, node.data_port, node.text_datagrams, node.public_key,
                   node.control_port if node.public_key else 0) for node in rig.nodes)]
    return network(one) == network(other)
