"""Client and server over real sockets: commands, refusals, streams, a node's control channel, a vanished engine."""

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
import zmq
from fake_tracker import FakeTracker
from patience import PATIENCE_MS, PATIENCE_S, eventually, settled
from synthetic_node import SyntheticNode, synthetic_rig

from rhot_app.engine import client as engine_client
from rhot_app.engine import core, node_control
from rhot_app.engine.client import EngineClient
from rhot_app.engine.core import Engine
from rhot_app.engine.directory import EngineDirectory, open_directory
from rhot_app.engine.node_control import NodeControl
from rhot_app.engine.serve import Server, StatePublisher
from rhot_app.engine.status import EngineStatus, NodeStatus, Preview
from rhot_app.errors import EngineError, RecordingError
from rhot_app.project import Rig, load_rig
from rhot_app.recording.bookmarks import Bookmark, read_bookmarks
from rhot_app.recording.video import video_name
from rhot_app.sources.links import UdpNodes
from rhot_app.state import HandState
from rhot_node.files import JSON_BYTES_MAX
from rhot_node.keys import new_key_pair
from rhot_node.network.context import Context
from rhot_node.threads import OneShotThread
from rhot_node.wire.messages import NodeState


class ControlPeer:
    """A node's control channel: answers what it is told to, publishes a preview when somebody subscribes."""

    def __init__(self) -> None:
        self.context = zmq.Context()
        self.requests = self.context.socket(zmq.REP)
        self.port = self.requests.bind_to_random_port("tcp://127.0.0.1")
        self.previews = self.context.socket(zmq.XPUB)
        self.preview_port = self.previews.bind_to_random_port("tcp://127.0.0.1")
        self.heard: list[dict[str, object]] = []
        self.hold = threading.Event()
        self.hold.set()
        self.subscribed = False
        self.video: dict[str, object] = {"message": "", "dropped": 0}
        self.ending = False
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def run(self) -> None:
        while not self.ending:
            if self.requests.poll(20):
                request = msgspec.json.decode(self.requests.recv())
                self.heard.append(request)
                self.hold.wait(PATIENCE_S)
                self.requests.send_multipart(self.answer(request))
            if self.previews.poll(0):
                self.subscribed = self.previews.recv()[:1] == b"\x01"
            if self.subscribed:
                self.previews.send_multipart([b'{"node_id": 1, "number": 7, "t_node_ns": 70, "width": 640, '
                                              b'"height": 480}', b"\xff\xd8jpeg"])

    def answer(self, request: dict[str, object]) -> list[bytes]:
        if request["request"] == "still":
            kind = request.get("format", "png")
            return [f'{{"ok": true, "width": 640, "format": "{kind}"}}'.encode(), b"\x89PNG"]
        if request["request"] == "state":
            return [b'{"ok": true, "state": "fault", "message": "the camera is gone: plug it in.", "health": '
                    b'[{"code": "heat", "level": "error", "text": "Its processor is too hot."}]}']
        if request["request"] in ("video_start", "video_stop"):
            return [msgspec.json.encode({"ok": True, "video": self.video})]
        return [b'{"ok": false, "error": "no such request."}']

    def close(self) -> None:
        self.ending = True
        self.thread.join()
        self.context.destroy(0)


class Bench:
    def __init__(self, rig: Rig, path: Path, tracker: type[FakeTracker] = FakeTracker) -> None:
        self.context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        place = open_directory(path)
        nodes = NodeControl(self.context)
        publisher = StatePublisher(self.context, place)
        self.engine = Engine(rig, None, UdpNodes, tracker, publisher, nodes.message)
        self.server = self.make_server(self.context, place, self.engine, nodes)
        self.thread = threading.Thread(target=self.server.run)
        self.thread.start()

    def make_server(self, context: zmq.Context[zmq.Socket[bytes]], place: EngineDirectory, engine: Engine,
                    nodes: NodeControl) -> Server:
        return Server(context, place, engine, nodes)

    def close(self) -> None:
        self.server.end()
        self.thread.join()
        self.server.close()
        self.engine.close()
        self.context.destroy(0)


@pytest.fixture(autouse=True)
def short_periods(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nodes are asked ten times as often as by an engine of its own, and an absent one is given up as early."""
    for module, name in ((node_control, "_STATE_PERIOD_S"), (node_control, "_VIDEO_PERIOD_S"),
                         (engine_client, "ABSENT_S")):
        monkeypatch.setattr(module, name, 0.1)


@pytest.fixture
def peer() -> Iterator[ControlPeer]:
    peer = ControlPeer()
    yield peer
    peer.close()


@pytest.fixture
def rig(peer: ControlPeer) -> Rig:
    rig = synthetic_rig()
    left = msgspec.structs.replace(rig.nodes[0], control_port=peer.port, preview_port=peer.preview_port)
    return msgspec.structs.replace(rig, nodes=(left, msgspec.structs.replace(rig.nodes[1], control_port=9)))


@pytest.fixture
def bench(rig: Rig, tmp_path: Path) -> Iterator[Bench]:
    bench = Bench(rig, tmp_path / "e")
    yield bench
    bench.close()


@pytest.fixture
def client(bench: Bench, tmp_path: Path) -> Iterator[EngineClient]:
    with EngineClient(tmp_path / "e") as client:
        yield client


@pytest.fixture(scope="module")
def refusing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[EngineClient]:
    """A client of an engine that does nothing of what it is told, so that nobody leaves a trace."""
    path = tmp_path_factory.mktemp("refusing") / "e"
    bench = Bench(synthetic_rig(), path)
    with EngineClient(path) as client:
        yield client
    bench.close()


def collect(client: EngineClient, kind: type) -> object:
    came: list[object] = []
    eventually(lambda: came.extend(message for message in client.poll(0.05) if isinstance(message, kind)) or came,
               told=lambda: f"no {kind.__name__} came")
    return came[0]


def status_when(client: EngineClient, condition: Callable[[EngineStatus], object]) -> EngineStatus:
    """The first status of which something is true."""
    statuses: list[EngineStatus] = []

    def came() -> bool:
        statuses[:] = [message for message in client.poll(0.05) if isinstance(message, EngineStatus)]
        statuses[:] = [status for status in statuses if condition(status)]
        return bool(statuses)

    eventually(came, told=lambda: f"never; the last was {client.status}")
    return statuses[0]


def test_states_and_status_reach_the_client(rig: Rig, client: EngineClient) -> None:
    nodes = [SyntheticNode(rig, camera) for camera in (0, 1)]
    for node in nodes:
        node.start()
    assert client.command("hello")["rig_name"] == "synthetic"
    client.command("start")
    state = collect(client, HandState)
    assert isinstance(state, HandState) and state.marker_ids == rig.markers.ids
    status = collect(client, EngineStatus)
    assert isinstance(status, EngineStatus) and status.running
    assert client.state is not None and client.status is not None and client.connected
    client.command("stop")
    for node in nodes:
        node.close()
    assert msgspec.convert(client.command("status")["status"], EngineStatus).running is False


def test_rig_travels_and_is_validated(client: EngineClient, tmp_path: Path, bench: Bench) -> None:
    document = client.command("rig")["document"]
    document["name"] = "another"
    client.command("set_rig", document=document)
    assert bench.engine.rig.name == "another"
    document["nodes"][0]["node_id"] = document["nodes"][1]["node_id"]
    with pytest.raises(EngineError, match="node_id"):
        client.command("set_rig", document=document)
    assert bench.engine.rig.name == "another"
    assert client.command("save_rig", path=str(tmp_path / "rig.json"))["path"] == str(tmp_path / "rig.json")
    assert load_rig(tmp_path / "rig.json") == bench.engine.rig
    (tmp_path / "letter.json").write_text('{"format": "a letter"}')
    with pytest.raises(EngineError, match="no rig file"):
        client.command("save_rig", path=str(tmp_path / "letter.json"))
    assert (tmp_path / "letter.json").read_text() == '{"format": "a letter"}'


class SlowTracker(FakeTracker):
    """Takes as long to make as the code takes to compile."""

    compiled = threading.Event()

    def __init__(self, rig: Rig) -> None:
        super().__init__(rig)
        if rig.name == "slow":
            assert self.compiled.wait(PATIENCE_S)


def test_status_and_commands_go_on_while_a_rigs_tracker_is_compiled(
        rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(core, "PREPARING_S", 0.05)
    SlowTracker.compiled.clear()
    bench = Bench(rig, tmp_path / "slow", SlowTracker)
    try:
        with EngineClient(tmp_path / "slow") as client, EngineClient(tmp_path / "slow") as changer:
            slow = msgspec.to_builtins(msgspec.structs.replace(rig, name="slow"))
            change = threading.Thread(target=lambda: changer.command("set_rig", document=slow))
            change.start()
            eventually(lambda: any("prepared" in one.text for one in client.status.advice) if client.poll(0.05)
                       and client.status else False)
            client.command("start")
            assert status_when(client, lambda status: status.running).rig_name == rig.name
            assert settled(lambda: change.is_alive() and (client.poll(0.0) or client.connected))
            SlowTracker.compiled.set()
            change.join(PATIENCE_S)
            assert status_when(client, lambda status: status.rig_name == "slow").running
    finally:
        SlowTracker.compiled.set()
        bench.close()


def test_a_rig_is_waited_for_while_the_engine_is_too_busy_to_answer(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine_client, "ASKED_S", 0.1)
    busy_s = 3.5  # a question of its own, "hello", fails meanwhile
    context = Context()
    socket = context.socket(zmq.ROUTER)
    socket.bind(EngineDirectory(tmp_path).commands)
    begun_s = time.monotonic()

    def serve() -> None:
        time.sleep(busy_s)
        while socket.poll(1000):
            client, empty, text = socket.recv_multipart()
            socket.send_multipart([client, empty, b'{"ok": true, "asked": %s}' % text])

    server = threading.Thread(target=serve)
    server.start()
    try:
        with EngineClient(tmp_path) as client:
            assert client.command("set_rig", document={})["asked"]["command"] == "set_rig"
        assert time.monotonic() - begun_s >= busy_s
    finally:
        server.join()
        context.destroy(0)


def test_an_engine_that_is_silent_is_not_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine_client, "ASKED_S", 0.1)
    monkeypatch.setattr(engine_client, "SILENT_S", 0.5)
    context = Context()
    context.socket(zmq.ROUTER).bind(EngineDirectory(tmp_path).commands)
    with EngineClient(tmp_path) as client, pytest.raises(EngineError, match="set_rig"):
        client.command("set_rig", document={})
    context.destroy(0)


def test_what_fails_in_a_thread_of_the_engine_is_told(bench: Bench, client: EngineClient) -> None:
    task = OneShotThread("does nothing well", lambda: 1 // 0)
    status = status_when(client, lambda status: any("does nothing well" in one.text for one in status.advice))
    assert any("ZeroDivisionError" in one.text and one.level == "error" for one in status.advice)
    task.join()


def test_recording_by_command(client: EngineClient, tmp_path: Path) -> None:
    client.command("record", path=str(tmp_path / "a.log"))
    with pytest.raises(EngineError, match="already recording"):
        client.command("record", path=str(tmp_path / "b.log"))
    assert client.command("record_stop")["path"] == str(tmp_path / "a.log")
    assert client.command("record_stop")["path"] == ""
    assert client.command("record", path=str(tmp_path / "b.log"))
    with pytest.raises(EngineError, match="one line"):
        client.command("bookmark", text="two\nlines")
    marked = client.command("bookmark", text="the thumb")["t_master_ns"]
    client.command("bookmark", text="earlier", t_master_ns=5)
    client.command("record_stop")
    assert read_bookmarks(tmp_path / "b.log") == [Bookmark(5, "earlier"), Bookmark(marked, "the thumb")]
    with pytest.raises(EngineError, match="absolute"):
        client.command("record", path="a.log")


def test_video_is_asked_of_the_nodes_as_long_as_the_recording_lasts(
        client: EngineClient, peer: ControlPeer, tmp_path: Path) -> None:
    def told() -> list[tuple[object, object]]:
        return [(one["request"], one.get("name")) for one in peer.heard if str(one["request"]).startswith("video")]
    client.command("record", path=str(tmp_path / "plain.log"))
    client.command("record_stop")
    with pytest.raises(EngineError, match="true or false"):
        client.command("record", path=str(tmp_path / "a.log"), video="yes")
    assert not told()
    client.command("record", path=str(tmp_path / "a.log"), video=True)
    name = video_name(tmp_path / "a.log")
    eventually(lambda: told().count(("video_start", name)) >= 3)  # reminded, or the node would end it
    peer.video = {"message": "The node's disk has less than 512 MiB left.", "dropped": 0}
    status_when(client, lambda status: any("has ended. The node's disk" in one.text for one in status.advice))
    peer.video = {"message": "", "dropped": 7}
    status_when(client, lambda status: any("drops frames of its video, 7" in one.text for one in status.advice))
    client.command("record_stop")
    eventually(lambda: told()[-1] == ("video_stop", name))
    assert settled(lambda: told()[-1] == ("video_stop", name))
    status_when(client, lambda status: not any("video" in one.text for one in status.advice))
    with pytest.raises(RecordingError, match="without video"):
        video_name(tmp_path / "plain.log")


def test_an_engine_that_ends_ends_the_videos(
        rig: Rig, peer: ControlPeer, tmp_path: Path) -> None:
    bench = Bench(rig, tmp_path / "ending")
    bench.engine.record(tmp_path / "a.log", video=True)
    eventually(lambda: any(one["request"] == "video_start" for one in peer.heard))
    bench.close()
    eventually(lambda: peer.heard[-1]["request"] == "video_stop")


@pytest.mark.parametrize(("command", "arguments", "sentence"), [
    ("dance", {}, "no command 'dance'"), ("record", {}, "path"), ("set_rig", {}, "document"),
    ("set_rig", {"document": {"format": "other"}}, "not a"), ("preview", {"on": 1}, "true or false"),
    ("node", {"node_id": 99, "request": {}}, "no node 99"), ("node", {"node_id": 1}, "request"),
    ("still", {}, "no node None"), ("record", {"path": "/tmp/\0"}, "absolute path"),
    ("bookmark", {"text": "here"}, "nothing is being recorded"), ("bookmark", {}, '"text"'),
    ("bookmark", {"text": "here", "t_master_ns": "now"}, "monotonic clock"),
])
def test_wrong_commands_are_refused_with_a_sentence(refusing: EngineClient, command: str, arguments: dict[str, object],
                                                    sentence: str) -> None:
    with pytest.raises(EngineError, match=sentence):
        refusing.command(command, **arguments)


DEEP = b'{"command": "set_rig", "document": {"format": ' + b"[" * 50_000 + b"]" * 50_000 + b"}}"


@pytest.mark.parametrize("data", [
    b"", b"\xff", b"[]", b"{}", b'{"command": 3}', DEEP, DEEP.replace(b"[", b'{"a":').replace(b"]", b"}"),
    b'{"command": "bookmark", "text": "", "t_master_ns": ' + b"9" * 5000 + b"}",
    b'{"command": "' + b"x" * 100_000 + b'"}',
    b'{"command": "node", "node_id": ' + b"[" * 60 + b"]" * 60 + b', "request": "command"}',
    b'{"command": "record", "path": "/tmp/\\u0000 command"}',
], ids=lambda data: data[:50])
def test_broken_bytes_are_refused_and_the_engine_lives(refusing: EngineClient, data: bytes) -> None:
    with zmq.Context.instance().socket(zmq.REQ) as socket:
        socket.linger = 0
        socket.connect(refusing.directory.commands)
        socket.send(data)
        assert socket.poll(PATIENCE_MS)
        assert msgspec.json.decode(socket.recv())["ok"] is False
    assert refusing.command("hello")["pid"]


def test_a_command_without_end_is_not_read(refusing: EngineClient) -> None:
    with zmq.Context.instance().socket(zmq.REQ) as socket:
        socket.linger = 0
        events = socket.get_monitor_socket(zmq.EVENT_DISCONNECTED)
        socket.connect(refusing.directory.commands)
        socket.send(bytes(2 * JSON_BYTES_MAX + 1))
        assert events.poll(PATIENCE_MS), "the engine ends the connection"
        socket.disable_monitor()
    assert refusing.command("hello")["pid"]


def test_requests_go_to_the_node_and_back(client: EngineClient, peer: ControlPeer) -> None:
    still = client.command("still", node_id=1)
    assert still["png"] == b"\x89PNG" and still["answer"]["width"] == 640
    assert client.command("still", node_id=1, format="jpeg")["jpeg"]
    assert client.command("node", node_id=1, request={"request": "state"})["answer"]["state"] == "fault"
    with pytest.raises(EngineError, match="node left: no such request"):
        client.command("node", node_id=1, request={"request": "sing"})
    assert [request["request"] for request in peer.heard if request["request"] != "state"] == ["still", "still", "sing"]


def test_a_slow_node_delays_nobody_else(client: EngineClient, peer: ControlPeer, tmp_path: Path) -> None:
    slow = threading.Thread(target=lambda: EngineClient(tmp_path / "e").command("still", node_id=1))
    peer.hold.clear()
    slow.start()
    eventually(lambda: peer.heard)
    assert client.command("hello")["pid"] and slow.is_alive(), "answered while the node still thinks"
    peer.hold.set()
    slow.join()


def test_previews_only_when_asked(client: EngineClient, peer: ControlPeer) -> None:
    collect(client, EngineStatus)
    assert not peer.subscribed
    client.command("preview", on=True)
    preview = collect(client, Preview)
    assert isinstance(preview, Preview)
    assert (preview.camera, preview.width, preview.height) == ("left", 640, 480)
    assert preview.jpeg.startswith(b"\xff\xd8") and preview.t_node_ns == 70
    assert len(preview.pixels) == 0 and preview.t_master_ns == 0, "nothing is known of this frame"
    client.command("preview", on=False)
    eventually(lambda: not peer.subscribed)


def test_a_nodes_own_words_reach_the_status(rig: Rig, client: EngineClient) -> None:
    node = SyntheticNode(rig, 0, state=NodeState.FAULT)
    node.start()
    status = status_when(client, lambda status: status.nodes[0].message)
    node.close()
    assert status.nodes[0].state == "fault"
    assert any("Node left: the camera is gone" in advice.text for advice in status.advice)


def test_a_hot_node_is_told_until_it_is_silent(rig: Rig, client: EngineClient) -> None:
    def told(status: EngineStatus) -> bool:
        return any("Node left: its processor is too hot." in advice.text for advice in status.advice)

    node = SyntheticNode(rig, 0, state=NodeState.READY)
    node.start()
    assert told(status_when(client, told))
    node.close()
    assert not told(status_when(client, lambda status: not told(status))), "a node that is gone says nothing any more"


def test_a_vanished_engine_is_noticed(rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine_client, "VANISHED_S", 0.5)
    bench = Bench(rig, tmp_path / "f")
    with EngineClient(tmp_path / "f") as client:
        collect(client, EngineStatus)
        assert client.connected
        bench.close()
        eventually(lambda: not client.poll() and not client.connected)
        with pytest.raises(EngineError, match="rhot engine --rig"):
            client.command("hello", timeout_s=0.2)
        again = Bench(rig, tmp_path / "f")  # at the same place: the client comes back by itself
        collect(client, EngineStatus)
        assert client.command("hello")["pid"]
        client.command("quit")
        again.close()


def test_where_no_engine_is_a_client_says_so(tmp_path: Path) -> None:
    with EngineClient(tmp_path / "none") as client, pytest.raises(EngineError, match="There is no engine in"):
        client.command("status", timeout_s=30.0)


def test_a_camera_that_is_not_tracked_with_is_spared_the_search_for_landmarks(peer: ControlPeer, rig: Rig) -> None:
    """But not the other one, nor while a log is recorded, nor by a replay, which has no keys."""
    left, right = rig.nodes
    apart = msgspec.structs.replace(rig, nodes=(msgspec.structs.replace(left, pose_known=False), right))
    streaming = NodeStatus(left.node_id, left.name, "streaming", False, 30.0, 9, 0, {}, None, None, None)
    status = EngineStatus(1, 1, 1, True, "TRACKING", rig.name, "", 30.0, (streaming,), ())
    recorded = replace(status, log_path="a.rhotlog")
    for one, keys, said, spared in ((rig, True, status, False), (apart, True, recorded, False),
                                    (apart, False, status, False), (apart, True, status, True)):
        control = NodeControl(peer.context, new_key_pair() if keys else None)
        heard = len(peer.heard)
        try:
            control.follow(one)
            control.ask_for_states(said)

            def answered(control: NodeControl = control, said: EngineStatus = said, heard: int = heard,
                         wanted: str = "spare_landmarks" if spared else "state") -> bool:
                control.ask_for_states(said)
                control.answers()
                return [request["request"] for request in peer.heard[heard:]].count(wanted) > 1
            eventually(answered)
            assert any(request["request"] == "spare_landmarks" for request in peer.heard[heard:]) == spared
        finally:
            control.close()
