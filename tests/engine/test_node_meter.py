"""One word for a node: what the operator reads before and after the start."""

from types import SimpleNamespace

import msgspec
from synthetic_node import synthetic_rig

from rhot_app.engine.node_meter import RECENT_NS, NodeMeter
from rhot_app.sources.node_link import NodeLink

TEXT = b"1,2;3,4;5,6;7,8;9,10;11,12\n"
SECOND = 10**9


def test_a_text_node_is_ready_while_its_datagrams_wait_for_the_start() -> None:
    rig = synthetic_rig()
    text = msgspec.structs.replace(rig.nodes[0], text_datagrams=True)
    link = NodeLink(msgspec.structs.replace(rig, nodes=(text, *rig.nodes[1:])), 0)
    meter = NodeMeter(link, SimpleNamespace(overflowed=0, skipped=0))

    def word_at(t_ns: int) -> str:
        meter.sample(t_ns)
        return meter.status(t_ns, "").state

    assert word_at(SECOND) == "silent"
    assert link.door.admit(TEXT, SECOND) is None
    assert word_at(SECOND + 1) == "ready"
    link.want(7, SECOND + 2)
    assert word_at(SECOND + 3) == "silent"
    assert link.door.admit(TEXT, SECOND + 4) is not None
    assert word_at(SECOND + 5) == "streaming"
    link.want(0, SECOND + 6)
    assert word_at(4 * SECOND) == "silent"
    assert link.door.admit(TEXT, 4 * SECOND) is None
    assert word_at(4 * SECOND + 1) == "ready"
    assert word_at(4 * SECOND + RECENT_NS) == "ready"
    assert word_at(4 * SECOND + 1 + RECENT_NS) == "silent"
