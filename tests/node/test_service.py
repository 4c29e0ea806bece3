"""The node as a system service: its unit, its installation on a fake host, what it tells the service manager."""

from __future__ import annotations

import configparser
import shutil
import socket
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest
from shipped_markers import RHOT6

from rhot_node.config import NodeSettings, load_settings, save_settings
from rhot_node.errors import NodeError
from rhot_node.service import Host, Service, ServiceManager, Wish, install, uninstall, unit_text

SERVICE = Service(Path("/opt/rhot/bin/python"), Path("/var/lib/rhot-node/node.json"), "pi")


def read_unit(text: str) -> configparser.ConfigParser:
    parser = configparser.ConfigParser(interpolation=None, comment_prefixes=("#",))
    parser.optionxform = str  # type: ignore[assignment,method-assign]
    parser.read_string(text)
    return parser


def test_the_unit_restarts_watches_bounds_and_confines() -> None:
    unit = read_unit(unit_text(SERVICE))["Service"]
    assert unit["ExecStart"] == ("/opt/rhot/bin/python -P -m rhot_node --settings /var/lib/rhot-node/node.json "
                                 "--camera pi")
    assert (unit["Type"], unit["Restart"], unit["WatchdogSec"]) == ("notify", "always", "20")
    assert unit["MemoryMax"] == "700M" and unit["StandardError"] == "journal"
    assert (unit["User"], unit["SupplementaryGroups"]) == ("rhot-node", "video")
    assert (unit["ProtectSystem"], unit["ProtectHome"], unit["NoNewPrivileges"]) == ("strict", "yes", "yes")
    assert unit["CapabilityBoundingSet"] == "" and "AF_PACKET" not in unit["RestrictAddressFamilies"]
    assert unit["CacheDirectory"] == "rhot-node" and unit["Environment"] == "XDG_CACHE_HOME=/var/cache/rhot-node"
    assert "MemoryDenyWriteExecute" not in unit, "the detector is compiled at run time"
    assert "PrivateDevices" not in unit, "the camera is a device"


def test_a_users_unit_has_nothing_that_only_root_may_ask_for() -> None:
    parser = read_unit(unit_text(Service(Path("/home/me/rhot/bin/python"), Path("/home/me/n.json"), "0", user=True)))
    assert "User" not in parser["Service"] and "ProtectSystem" not in parser["Service"]
    assert parser["Install"]["WantedBy"] == "default.target" and parser["Service"]["WatchdogSec"] == "20"


def test_words_reach_the_node_whole() -> None:
    unit = unit_text(Service(Path("/o/python"), Path("/my files/50%.json"), 'a"b$c'))
    assert r'--settings "/my files/50%%.json" --camera "a\"b$$c"' in unit


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="systemd-analyze is not here")
@pytest.mark.parametrize("user", [False, True])
def test_systemd_understands_the_unit(tmp_path: Path, user: bool) -> None:
    path = tmp_path / "rhot-node.service"
    path.write_text(unit_text(Service(Path("/bin/true"), tmp_path / "n.json", "pi", user)))
    done = subprocess.run(["systemd-analyze", *(["--user"] if user else []), "verify", str(path)], capture_output=True,
                          text=True, timeout=30, check=False)
    assert str(path.name) not in done.stderr, done.stderr


class Pi:
    """A host whose files lie in a folder, and which notes every command."""

    def __init__(self, root: Path, *, is_root: bool = True, prefix: str = "/opt/rhot", fails: str = "") -> None:
        self.commands: list[str] = []
        self.said: list[str] = []
        self.fails = fails
        self.known_user = False
        self.host = Host(root, self.run, is_root, root / "home/me", Path(prefix), Path(f"{prefix}/bin/python"))
        self.settings = root / "var/lib/rhot-node/node.json"
        self.unit = root / "etc/systemd/system/rhot-node.service"

    def run(self, command: Sequence[str]) -> str | None:
        line = " ".join(command)
        self.commands.append(line)
        if line == "id -u rhot-node":
            return None if self.known_user else "no such user"
        self.known_user |= line.startswith("useradd")
        return "it failed" if self.fails and self.fails in line else None

    def install(self, **wish: object) -> None:
        install(Wish(**wish), self.host, self.said.append)  # type: ignore[arg-type]


def test_a_new_node_is_installed_and_started(tmp_path: Path) -> None:
    pi = Pi(tmp_path)
    pi.install(node_id=2, name="right")
    settings = load_settings(pi.settings)
    assert (settings.node_id, settings.name) == (2, "right")
    assert "--camera pi" in pi.unit.read_text()
    order = [line.split()[0] for line in pi.commands]
    assert order == ["id", "useradd", "chown", "systemctl", "systemctl", "systemctl"]
    assert pi.commands[-3:] == ["systemctl daemon-reload", "systemctl enable rhot-node.service",
                                "systemctl restart rhot-node.service"]
    assert "--shell /usr/sbin/nologin" in pi.commands[1] and "--groups video" in pi.commands[1]
    assert "ready" in pi.said[-1]


def test_installing_again_keeps_user_and_settings(tmp_path: Path) -> None:
    pi = Pi(tmp_path)
    pi.install(node_id=2, name="right")
    before = pi.settings.read_bytes()
    pi.commands.clear()
    pi.install(camera="/dev/video2")
    for strange in ("pi\nExecStartPre=/bin/true", "pi\r", "\x1b[2J"):
        with pytest.raises(NodeError, match="control character"):
            pi.install(camera=strange)
    assert pi.settings.read_bytes() == before and not any("useradd" in line for line in pi.commands)
    assert "--camera /dev/video2" in pi.unit.read_text()


def test_settings_are_taken_over(tmp_path: Path) -> None:
    own = tmp_path / "mine.json"
    save_settings(own, NodeSettings(9, "mine", RHOT6))
    pi = Pi(tmp_path / "pi")
    pi.install(settings=own)
    assert load_settings(pi.settings).node_id == 9 and own.exists()


@pytest.mark.parametrize(("pi_is", "wish", "words"), [
    ({"is_root": False}, {"node_id": 1, "name": "left"}, "sudo /opt/rhot/bin/python -m rhot_node install"),
    ({"prefix": "/home/me/venv"}, {"node_id": 1, "name": "left"}, "/opt/rhot"),
    ({}, {}, "--node-id and --name"),
    ({}, {"node_id": 0, "name": "left"}, "node_id"),
    ({"fails": "useradd"}, {"node_id": 1, "name": "left"}, "useradd.*failed: it failed"),
    ({"fails": "restart"}, {"node_id": 1, "name": "left"}, "journalctl -u rhot-node")])
def test_what_hinders_is_said(tmp_path: Path, pi_is: dict[str, object], wish: dict[str, object], words: str) -> None:
    pi = Pi(tmp_path, **pi_is)  # type: ignore[arg-type]
    with pytest.raises(NodeError, match=words):
        pi.install(**wish)
    assert pi.unit.exists() == ("restart" in str(pi_is)), "nothing is half installed"


def test_a_service_of_ones_own_needs_no_root(tmp_path: Path) -> None:
    pi = Pi(tmp_path, is_root=False, prefix="/home/me/venv")
    pi.install(node_id=1, name="left", user=True)
    assert load_settings(tmp_path / "home/me/.config/rhot-node/node.json").name == "left"
    assert (tmp_path / "home/me/.config/systemd/user/rhot-node.service").exists()
    assert pi.commands == ["systemctl --user daemon-reload", "systemctl --user enable rhot-node.service",
                           "systemctl --user restart rhot-node.service"]


def test_uninstalling_keeps_settings_and_says_where(tmp_path: Path) -> None:
    pi = Pi(tmp_path)
    with pytest.raises(NodeError, match="no such service"):
        uninstall(False, pi.host, pi.said.append)
    pi.install(node_id=1, name="left")
    uninstall(False, pi.host, pi.said.append)
    assert not pi.unit.exists() and pi.settings.exists()
    assert pi.commands[-2:] == ["systemctl disable --now rhot-node.service", "systemctl daemon-reload"]
    assert "/var/lib/rhot-node" in pi.said[-1]


def listen(path: str) -> socket.socket:
    sock = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    sock.bind(path)
    sock.settimeout(2.0)
    return sock


@pytest.mark.parametrize("abstract", [False, True])
def test_the_service_manager_hears_that_the_node_is_ready_and_alive(tmp_path: Path, abstract: bool) -> None:
    name = f"@rhot-test-{tmp_path.name}-{id(tmp_path)}" if abstract else str(tmp_path / "notify")
    now_s = [0.0]
    with listen(f"\0{name[1:]}" if abstract else name) as heard:
        manager = ServiceManager({"NOTIFY_SOCKET": name, "WATCHDOG_USEC": "30000000"}, lambda: now_s[0])
        manager.ready("node left")
        assert heard.recv(200) == b"READY=1\nSTATUS=node left"
        for now_s[0] in (0.0, 1.0, 9.9, 10.0, 19.0, 20.0):
            manager.alive()
        manager.stopping()
        manager.alive()
        assert [heard.recv(200) for _ in range(4)] == [b"WATCHDOG=1"] * 3 + [b"STOPPING=1"]
        heard.settimeout(0.01)
        with pytest.raises(TimeoutError):
            heard.recv(200)


@pytest.mark.parametrize("environment", [
    {}, {"NOTIFY_SOCKET": "/nowhere/notify", "WATCHDOG_USEC": "1000000"}, {"WATCHDOG_USEC": "x", "WATCHDOG_PID": "1"}])
def test_without_a_service_manager_nothing_happens(environment: dict[str, str]) -> None:
    manager = ServiceManager(environment)
    manager.ready("node left")
    manager.alive()
    assert manager.stopping() is None
