"""Specs, as typed and as in a rig file: what they mean, and the sentence for each that cannot be."""

from __future__ import annotations

import re
import sys

import msgspec
import pytest

from rhot_app.errors import OutputError, RigError
from rhot_app.outputs.outputs import make_sink
from rhot_app.outputs.spec import host_and_port, parse_output, web_settings
from rhot_app.project import OutputSettings, Rig, parse_rig


@pytest.mark.parametrize(("text", "settings"), [
    ("osc:10.0.0.2:9000", OutputSettings("osc", "10.0.0.2:9000")),
    ("ws:9001?joints=openxr&hz=60", OutputSettings("ws", "9001", "openxr", 60.0)),
    ("vmc:[::1]:39539", OutputSettings("vmc", "[::1]:39539")),
    ("lsl", OutputSettings("lsl")), ("zenoh:router:7447?hz=0.5", OutputSettings("zenoh", "router:7447", "own", 0.5)),
    ("my-plug.in:a:b/c", OutputSettings("my-plug.in", "a:b/c")),
])
def test_a_spec_means_its_settings_and_back(text: str, settings: OutputSettings) -> None:
    assert parse_output(text) == settings
    assert parse_output(settings.spec) == settings


@pytest.mark.parametrize(("text", "host", "port"), [
    ("osc:10.0.0.2:9000", "10.0.0.2", 9000), ("osc:[fe80::1]:1", "fe80::1", 1), ("ws:9001", "127.0.0.1", 9001),
    ("ws:0.0.0.0:65535", "0.0.0.0", 65535)])
def test_targets(text: str, host: str, port: int) -> None:
    settings = parse_output(text)
    assert host_and_port(settings, "127.0.0.1" if settings.kind == "ws" else None) == (host, port)


@pytest.mark.parametrize(("text", "target"), [
    ("", "127.0.0.1:47810"), ("8080", "8080"), ("0.0.0.0", "0.0.0.0:47810"), ("192.168.1.5:8080", "192.168.1.5:8080")])
def test_web_addresses(text: str, target: str) -> None:
    assert web_settings(text) == OutputSettings("web", target, "openxr")


@pytest.mark.parametrize("text", ["host:abc", "1.2.3.4:99999", "0", "x y"])
def test_a_bad_web_address_is_named_as_typed(text: str) -> None:
    with pytest.raises(OutputError, match=rf"^web view on {re.escape(text)}: this is not \[HOST:\]PORT"):
        web_settings(text)


@pytest.mark.parametrize(("text", "sentence"), [
    ("", "no kind of output"), (":9000", "no kind of output"), ("os c:h:1", "no kind of output"),
    ("carrier-pigeon:coop", "there is no output 'carrier-pigeon'; there are osc, vmc, ws, lsl, zenoh"),
    ("osc", "is not HOST:PORT"), ("osc:9000", "is not HOST:PORT"), ("osc:host:", "is not HOST:PORT"),
    ("osc:a:b", "is not HOST:PORT"), ("osc:::1:9000", "is not HOST:PORT"), ("osc:h:1:2", "is not HOST:PORT"),
    ("osc:host:0", "no port 0"), ("osc:host:70000", "no port 70000"), ("ws", "is not [HOST:]PORT"),
    ("ws:x", "is not [HOST:]PORT"), ("web:x y:1", "is not [HOST:]PORT"), ("vmc:9000", "is not HOST:PORT"),
    ("zenoh:7447", "is not HOST:PORT"),
    ("ws:9001?hz=0", "not a rate above 0"), ("ws:9001?hz=-3", "not a rate above 0"),
    ("ws:9001?hz=nan", "not a rate above 0"), ("ws:9001?hz=inf", "not a rate above 0"),
    ("ws:9001?hz=fast", "not a number"), ("ws:9001?hz=", "option 'hz=' is not known"),
    ("ws:9001?speed=3", "option 'speed=3' is not known"), ("ws:9001?joints=bones", "there are no joints 'bones'"),
])
def test_a_bad_spec_is_a_sentence(text: str, sentence: str) -> None:
    with pytest.raises(OutputError) as raised:
        make_sink(parse_output(text))
    assert sentence in str(raised.value)


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "rhot_app.outputs.ws", raising=False)
    monkeypatch.setitem(sys.modules, "websockets.http11", None)
    with pytest.raises(OutputError, match="needs the package websockets"):
        make_sink(parse_output("ws:9001"))


def test_a_rig_file_lists_outputs(rig: Rig) -> None:
    listed = msgspec.structs.replace(rig, outputs=(OutputSettings("osc", "h:1", "openxr", 30.0), OutputSettings("lsl")))
    assert parse_rig(msgspec.json.encode(listed), "a rig") == listed
    assert parse_rig(msgspec.json.encode(rig), "a rig").outputs == ()


@pytest.mark.parametrize(("output", "sentence"), [
    ({"kind": "osc", "target": "h:1", "rate_hz": 0}, "rate_hz"), ({"target": "h:1"}, "kind"),
    ({"kind": "osc", "port": 3}, "port"), ({"kind": "osc", "joints": "bones"}, "joints"), ({"kind": "a b"}, "kind")])
def test_a_rig_file_with_a_bad_output_names_the_field(rig: Rig, output: dict[str, object], sentence: str) -> None:
    document = msgspec.to_builtins(rig) | {"outputs": [output]}
    with pytest.raises(RigError, match=sentence):
        parse_rig(msgspec.json.encode(document), "a rig")
