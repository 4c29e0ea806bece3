"""What leaves the 3-D mouse: OSC messages, events of the system's pointer, lines of the command, sentences."""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import struct
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pythonosc.osc_bundle import OscBundle

from rhot_app.__main__ import main
from rhot_app.errors import OutputError
from rhot_app.evaluation.data_sets import LOG_NAME, Order, data_set
from rhot_app.mouse import mouse_command
from rhot_app.mouse.pointer import MouseSettings, MouseState
from rhot_app.mouse.script import Script, motion_file
from rhot_app.mouse.system_pointer import SystemPointer
from rhot_app.outputs.osc import bundles, mouse_messages
from rhot_app.project import save_rig, with_tracker
from rhot_app.simulator.scene.motion import Sway
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.state import Condition
from rhot_node.files import write_document


def mouse(*cursor: float, pressed: tuple[str, ...] = ()) -> MouseState:
    return MouseState(0, Condition.TRACKING, np.array(cursor) if cursor else None, frozenset(pressed))


def test_osc_messages_have_cursor_and_buttons() -> None:
    first, second = mouse_messages((0.5, -1.0, 0.25), {"little"})
    assert first == b"/rhot/mouse/cursor\0\0,fff\0\0\0\0\x3f\0\0\0\xbf\x80\0\0\x3e\x80\0\0"
    assert second == b"/rhot/mouse/buttons\0,ii\0\0\0\0\0\0\0\0\1"
    (bundle,) = bundles(mouse_messages(None, ()))
    assert [(one.address, one.params) for one in OscBundle(bundle)] == [("/rhot/mouse/buttons", [0, 0])]


class Device:
    """A file in place of /dev/uinput, and what was asked of it."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "uinput"
        self.path.touch()
        self.asked: list[tuple[int, object]] = []

    def ioctl(self, file: int, request: int, argument: object) -> None:
        self.asked.append((request, argument))

    def events(self) -> list[tuple[int, int, int]]:
        """(type, code, value) of what was written."""
        return [event[2:] for event in struct.iter_unpack("@llHHi", self.path.read_bytes())]


def test_the_pointer_is_created_moved_clicked_and_removed(tmp_path: Path) -> None:
    device = Device(tmp_path)
    pointer = SystemPointer(device.path, device.ioctl)
    assert (0x40045565, 0x110) in device.asked and (0x40045565, 0x111) in device.asked  # both buttons
    setups = [argument for request, argument in device.asked if request == 0x401C5504]
    assert setups[0] == struct.pack("@HHiiiiii", 0, 0, 0, 0, 32767, 0, 0, 0) and len(setups[0]) == 28
    (setup,) = [argument for request, argument in device.asked if request == 0x405C5503]
    assert len(setup) == 92 and setup[8:22] == b"RHOT 3-D mouse"
    assert device.asked[-1][0] == 0x5501
    pointer.write(mouse(0.24, 0.18, 0.0))
    pointer.write(mouse(0.24, 0.18, 0.1, pressed=("thumb",)))
    pointer.write(mouse(0.24, 0.18, 0.2, pressed=("thumb",)))  # nothing new
    pointer.write(mouse(-0.24, -0.18, 0.0))
    pointer.close()
    assert device.events() == [(3, 0, 32767), (0, 0, 0), (1, 0x110, 1), (0, 0, 0),
                               (3, 0, 0), (3, 1, 32767), (1, 0x110, 0), (0, 0, 0)]
    assert device.asked[-1][0] == 0x5502


def test_a_pointer_without_device_or_permission_raises_an_error_with_advice(tmp_path: Path, monkeypatch) -> None:
    with pytest.raises(OutputError, match="modprobe uinput"):
        SystemPointer(tmp_path / "none")

    def refuse(*args: object) -> int:
        raise PermissionError(13, "Permission denied")
    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(OutputError, match="needs write permission"):
        SystemPointer(tmp_path / "uinput")


def test_a_file_that_is_no_uinput_device_is_refused(tmp_path: Path) -> None:
    (tmp_path / "uinput").touch()
    with pytest.raises(OutputError, match="uinput device"):
        SystemPointer(tmp_path / "uinput")


def test_a_replayed_state_has_no_age(capsys) -> None:
    """Its time is that of the recording."""
    arguments = argparse.Namespace(json=True, pointer=False, osc=None)
    with contextlib.ExitStack() as stack:
        outputs = mouse_command._Outputs(arguments, stack)
        outputs.write(mouse(0.1, 0.0, 0.0))
        outputs.write(replace(mouse(pressed=("thumb",)), t_master_ns=time.monotonic_ns()))
    old, new = (json.loads(line) for line in capsys.readouterr().out.splitlines())
    assert old["age_ms"] is None and old["cursor_m"] == [0.1, 0.0, 0.0]
    assert new["age_ms"] >= 0.0 and new["cursor_m"] is None and new["pressed"] == ["thumb"]


@pytest.mark.parametrize(("every_s", "slow"), [(0.4, True), (0.1, False)])
def test_the_last_line_says_whether_enough_states_came(every_s: float, slow: bool, capsys: pytest.CaptureFixture[str],
                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    now_s = [100.0]
    monkeypatch.setattr(mouse_command.time, "monotonic", lambda: now_s[0])
    monkeypatch.setattr(mouse_command.time, "monotonic_ns", lambda: round(1e9 * now_s[0]))
    with contextlib.ExitStack() as stack:
        outputs = mouse_command._Outputs(argparse.Namespace(json=False, pointer=False, osc=None), stack)
        for _ in range(11):
            outputs.write(replace(mouse(), t_master_ns=round(1e9 * (now_s[0] - 0.05))))
            now_s[0] += every_s
        outputs.close()
    lines, said = capsys.readouterr()
    assert len(lines.splitlines()) == 11
    assert f"11 states: {1 / every_s:.1f} a second" in said and "50 ms (p50)" in said
    assert ("too slow or too busy" in said) == slow


FORMER = ("--measure", "--gain")


@pytest.mark.parametrize(("arguments", "words"), [
    (("--osc", "nowhere"), "HOST:PORT"), (("--measure", "--pointer"), "no option '--pointer'"),
    (("--bare",), "--simulated and `rhot mouse measure`"), (("--rig", "rig.json"), "for a --log"),
    (("--places", "3"), "no option '--places'"), (("--log", __file__, "--seconds", "3"), "leave --seconds out"),
    (("--seconds", "abc"), "abc is not a finite number"), (("--set", "gain=-1"), "--set gain=-1: -1 is not a number"),
    (("--gain", "-1"), "--set gain=-1: -1 is not"), (("--set", "speed=1"), "the names are gain, height_gain"),
    (("--set", "height_from=wrist"), "it is index or palm"), (("--set", "on_table"), "it is true or false"),
    (("--log", __file__, "--simulated"), "not allowed with"),
    (("--log", __file__, "--directory", "NONE"), "leave --directory out"),
    (("--seed", "1.5"), "1.5 is not a whole number"), (("--log", "NONE"), "none"),
    (("--directory", "NONE"), "no engine is heard")])
def test_contradictory_options_end_with_a_sentence(arguments: tuple[str, ...], words: str, tmp_path: Path,
                                                   monkeypatch: pytest.MonkeyPatch,
                                                   capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(mouse_command, "PATIENCE_S", 0.2)
    try:
        code = main(["mouse", *([] if arguments[0] in FORMER else ["run"]),
                     *(str(tmp_path / "none") if one == "NONE" else one for one in arguments)])
    except SystemExit as mistake:
        code = mistake.code
    said = capsys.readouterr()
    assert code == 2 and words in said.err and not said.out


def test_a_recording_controls_the_mouse_as_the_hand_did(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    script, scene = Script(), make_scene(twin_defaults(), 1)
    script.move((0.06, -0.03, 0.0), 0.5)
    script.click("thumb")
    script.wait(0.3)
    write_document(tmp_path / "motion.json", motion_file(script, scene.hand, MouseSettings(), Sway()))
    data = data_set(Order(scene, str(tmp_path / "motion.json"), script.end_s, sketched=True), tmp_path)
    save_rig(tmp_path / "rig.json", with_tracker(data.rig, "estimator"))
    parser = argparse.ArgumentParser()
    mouse_command.add_arguments(parser)
    asked = ["run", "--log", str(data.folder / LOG_NAME), "--rig", str(tmp_path / "rig.json"), "--json"]
    assert mouse_command.run(parser.parse_args(asked)) == 0
    states = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert states[-1]["cursor_m"] == pytest.approx([0.06, -0.03, 0.0], abs=0.01)
    assert {tuple(state["pressed"]) for state in states} == {(), ("thumb",)} and not states[-1]["pressed"]
    assert all(state["age_ms"] is None for state in states)
