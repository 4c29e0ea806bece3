"""`rhot-node doctor` on fake machines: what it looks at, what it says, its exit codes and its JSON."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from machine_fake import machine
from node_fakes import node_settings, saved_settings

import rhot_node.commands.doctor_command
import rhot_node.compiled
from rhot_node.capture.pi_camera import CameraStack
from rhot_node.commands.doctor_command import (
    check_camera,
    check_compiled,
    check_landmarks,
    check_service,
    check_settings,
    examine,
    run,
)
from rhot_node.compiled import sources_hash
from rhot_node.config import CameraSettings
from rhot_node.errors import CameraError, KeypointError
from rhot_node.health.checks import Check, worst
from rhot_node.keys import Master, NodeTrust, keys_path, new_key_pair

SHOW = "systemctl show rhot-node.service --property=LoadState,ActiveState,NRestarts"


def stack(*models: str) -> CameraStack:
    camera_class = SimpleNamespace(global_camera_info=lambda: [{"Model": model} for model in models])
    return CameraStack(SimpleNamespace(Picamera2=camera_class), None)


def no_picamera2() -> CameraStack:
    raise CameraError("a Pi camera needs picamera2: sudo apt install it.")


def service(load: str, active: str, restarts: int) -> dict[str, str]:
    return {SHOW: f"LoadState={load}\nActiveState={active}\nNRestarts={restarts}\n"}


@pytest.fixture
def settings(tmp_path: Path) -> Path:
    return saved_settings(tmp_path / "left.json", trust="paired").path


def test_a_well_pi_has_nothing_to_complain_of(tmp_path: Path, settings: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rhot_node.commands.doctor_command, "is_compiled_in", lambda _cache: True)
    NodeTrust(keys_path(settings)).add(Master(new_key_pair().public_key, "desk"))
    pi = machine(tmp_path / "pi", commands=service("loaded", "active", 0))
    checks = examine(pi, settings, tmp_path, lambda: stack("imx219"))
    assert worst(checks) == "ok", [check for check in checks if check.level != "ok"]
    assert [check.code for check in checks] == ["machine", "power", "heat", "memory", "speed", "clock", "network",
                                                "camera", "compiled", "settings", "pairing", "service", "memory_limit"]
    text = {check.code: check.text for check in checks}
    assert "Raspberry Pi 4" in text["machine"] and "presets wide, fast" in text["camera"] and "desk" in text["pairing"]


def test_everything_wrong_is_named_with_its_remedy(tmp_path: Path) -> None:
    pi = machine(tmp_path, {
        "sys/devices/platform/soc/soc:firmware/get_throttled": "5000d",
        "sys/class/thermal/thermal_zone0/temp": "84000", "proc/meminfo": "MemAvailable: 40000 kB\n",
        "sys/class/net/eth0/operstate": "down", "sys/fs/cgroup/cgroup.controllers": "cpu"},
        service("loaded", "failed", 7))
    checks = {check.code: check for check in examine(pi, None, tmp_path, no_picamera2)}
    for code in ("power", "heat", "memory", "network", "camera", "service"):
        assert checks[code].level == "error" and checks[code].remedy, code
    assert checks["compiled"].level == checks["memory_limit"].level == "warning"
    assert "cgroup_enable=memory" in checks["memory_limit"].remedy
    assert "apt install" in checks["camera"].remedy and "7 times" in checks["service"].text


@pytest.mark.parametrize(("is_pi", "models", "devices", "level", "word"), [
    (True, None, True, "error", "picamera2"), (False, None, True, "ok", "/dev/video0"),
    (False, None, False, "error", "no camera"), (True, (), True, "error", "ribbon cable"),
    (True, ("imx296", "imx708"), True, "ok", "imx296 (presets global), imx708 (no presets)")])
def test_cameras(tmp_path: Path, is_pi: bool, models: tuple[str, ...] | None, devices: bool, level: str,
                 word: str) -> None:
    """A Pi has video devices even without a camera."""
    pi = machine(tmp_path, {} if devices else {"dev/video0": None})
    check = check_camera(pi, is_pi, no_picamera2 if models is None else lambda: stack(*models))
    assert check.level == level and word in check.sentence


def test_compiled_code_is_looked_for_in_the_users_and_the_services_cache(tmp_path: Path) -> None:
    caches = [tmp_path / "user", tmp_path / "service"]
    assert check_compiled(caches).level == "warning"
    package = Path(rhot_node.compiled.__file__).parent
    packages = [package, package.parent / "rhot_app"]  # a node may have no master's package
    present = sources_hash([folder for folder in packages if folder.is_dir()])
    folder = caches[1] / "rhot" / "numba" / present / "detect_1"
    folder.mkdir(parents=True)
    (folder / "kernel.nbi").touch()
    assert check_compiled(caches).level == "ok"


def test_settings_and_pairing(tmp_path: Path, settings: Path) -> None:
    pi = machine(tmp_path / "pi")
    assert check_settings(pi, None) == [], "no service, no settings named"
    assert [check.level for check in check_settings(pi, settings)] == ["ok", "warning"]
    assert not keys_path(settings).exists(), "looking must not draw keys"
    NodeTrust(keys_path(settings))
    assert "rhot-node pair" in check_settings(pi, settings)[1].remedy
    keys_path(settings).chmod(0o644)
    assert check_settings(pi, settings)[1].level == "warning", "keys that others may read"
    opened = json.loads(settings.read_text()) | {"trust": "open"}
    settings.write_text(json.dumps(opened))
    assert "open" in check_settings(pi, settings)[1].text
    settings.write_text("{")
    (broken,) = check_settings(pi, settings)
    assert broken.level == "error" and str(settings) in broken.text


@pytest.mark.parametrize(("state", "level"), [
    (("not-found", "inactive", 0), None), (("loaded", "active", 0), "ok"), (("loaded", "active", 3), "warning"),
    (("loaded", "activating", 9), "error")])
def test_the_service(tmp_path: Path, state: tuple[str, str, int], level: str | None) -> None:
    checks = check_service(machine(tmp_path, commands=service(*state)))
    assert (checks[0].level if checks else None) == level


@pytest.mark.parametrize(("level", "code"), [("ok", 0), ("unknown", 0), ("warning", 1), ("error", 2)])
def test_exit_code_and_json(level: Any, code: int, monkeypatch: pytest.MonkeyPatch,
                            capsys: pytest.CaptureFixture[str]) -> None:
    checks = [Check("heat", level, "It is so.", "Do it.")]
    monkeypatch.setattr(rhot_node.commands.doctor_command, "examine", lambda *_: checks)
    assert run(argparse.Namespace(settings=None, json=True)) == code
    told = json.loads(capsys.readouterr().out)
    assert told == {"verdict": level,
                    "checks": [{"code": "heat", "level": level, "text": "It is so.", "remedy": "Do it."}]}
    assert run(argparse.Namespace(settings=None, json=False)) == code
    assert "It is so. Do it." in capsys.readouterr().out


class CostlyNetworks:
    """Networks of which a search and a hand take so long, s."""

    def __init__(self, search_s: float, hand_s: float) -> None:
        self.costs = search_s, hand_s

    def cost_s(self, picture: Any) -> tuple[float, float]:
        assert picture.shape == (480, 640, 3)
        return self.costs


@pytest.mark.parametrize(("detector", "hand_s", "level", "words"), [
    ("landmarks", 0.009, "ok", ("9 ms", "18 ms", "up to 30 of 30")),
    ("landmarks", 0.095, "warning", ("95 ms", "up to 9 of 30", "landmarks:lite")),
    ("landmarks:lite", 0.095, "warning", ("lite", "up to 9 of 30")),
])
def test_the_rate_of_landmarks_to_expect(detector: str, hand_s: float, level: str, words: tuple[str, ...]) -> None:
    settings = node_settings(detector=detector, camera=CameraSettings(fps=30.0))
    (check,) = check_landmarks(settings, lambda model: CostlyNetworks(0.05, hand_s))  # type: ignore[arg-type,return-value]
    assert check.level == level and all(word in check.sentence for word in words), check.sentence
    assert bool(check.remedy) == (level == "warning")


def test_networks_are_looked_at_where_they_are_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(model: str) -> Any:
        raise KeypointError("the hand networks are not installed. Run the command.")
    assert check_landmarks(node_settings(), missing) == []
    monkeypatch.setattr(rhot_node.commands.doctor_command, "open_networks", missing)
    path = saved_settings(tmp_path / "left.json", detector="landmarks").path
    (check,) = [check for check in check_settings(machine(tmp_path / "pi"), path) if check.code == "landmarks"]
    assert check.level == "error" and "not installed" in check.sentence
