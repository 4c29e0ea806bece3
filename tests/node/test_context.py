"""ZeroMQ contexts that are closed in the middle of a conversation, or dropped unclosed: nobody waits for them."""

from __future__ import annotations

import gc
import threading
import warnings
from pathlib import Path

import zmq
from patience import PATIENCE_S

from rhot_node.network.context import Client, Context, ask_all

ROOT = Path(__file__).parents[2]


def ends(work) -> bool:
    """Whether this comes to an end; in a thread, so that one that hangs fails and holds up nothing."""
    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(PATIENCE_S / 4)
    return not thread.is_alive()


def speak_to_nobody(context: Context, place: Path) -> None:
    """A request that waits for somebody to take it."""
    socket = context.socket(zmq.REQ)
    socket.connect(f"ipc://{place}")
    socket.send(b"hello")


def test_one_that_is_dropped_in_a_cycle_is_collected(tmp_path):
    def drop():
        context = Context()
        speak_to_nobody(context, tmp_path / "nobody")
        cycle = [context]
        cycle.append(cycle)

    gc.collect()
    before = threading.active_count()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        drop()
        assert ends(gc.collect)
    assert threading.active_count() == before


def test_one_that_is_closed_waits_for_no_answer(tmp_path):
    context = Context()
    speak_to_nobody(context, tmp_path / "nobody")
    assert ends(context.destroy)


def test_an_answer_arrives_although_the_connection_ends_behind_it():
    def answer_and_go(server):
        if server.poll(round(1e3 * PATIENCE_S)):
            server.recv()
            server.send(b"yes")
        server.close()

    for _ in range(40):
        context = Context()
        server = context.socket(zmq.REP)
        port = server.bind_to_random_port("tcp://127.0.0.1")
        server.setsockopt(zmq.LINGER, -1)
        thread = threading.Thread(target=answer_and_go, args=(server,))
        thread.start()
        client = Client(context, f"tcp://127.0.0.1:{port}", once=True)
        assert ask_all([(client, b"?")], PATIENCE_S) == [[b"yes"]]
        thread.join()
        context.destroy()


def test_no_other_kind_is_made():
    sources = [path for package in ("rhot_node", "rhot_app") for path in (ROOT / package).rglob("*.py")]
    assert [path.name for path in sources if "zmq.Context" in path.read_text()] == ["context.py"]
