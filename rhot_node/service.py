"""The node as a service of systemd: its unit, putting it in place and taking it away, and what it says when it runs."""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from rhot_node.config import NodeSettings, changed_settings, load_settings, save_settings
from rhot_node.errors import NodeError, printable
from rhot_node.files import resource_path, write_atomically
from rhot_node.markers import load_markers

# -- systemd unit ------------------------------------------------------------------------------------------------------

NAME = "rhot-node.service"
USER = "rhot-node"
STATE_FOLDER = Path("/var/lib/rhot-node")
WATCHDOG_S = 20
START_S = 900  # the first start compiles; on a Pi 3 that takes minutes
MEMORY_MAX_MB = 700  # compiling takes 360 to 480 MB, running 225


@dataclass(frozen=True, slots=True)
class Service:
    """What the unit runs: `python` of the node's environment, the settings file, and the camera as in --camera."""

    python: Path
    settings: Path
    camera: str
    user: bool = False  # a service of one user instead of the system's


def unit_text(service: Service) -> str:
    """The unit file. systemd(1) starts the node at boot, restarts it when it ends or hangs, and holds it in bounds."""
    restrictions = "" if service.user else _SYSTEM
    return f"""\
[Unit]
Description=RHOT camera node
After=network-online.target
Wants=network-online.target
StartLimitIntervalSec=0

[Service]
Type=notify
NotifyAccess=main
ExecStart={_command(service)}
Restart=always
RestartSec=2
TimeoutStartSec={START_S}
TimeoutStopSec=10
WatchdogSec={WATCHDOG_S}
MemoryMax={MEMORY_MAX_MB}M
OOMPolicy=stop
StandardOutput=null
StandardError=journal
NoNewPrivileges=yes
{restrictions}
[Install]
WantedBy={"default" if service.user else "multi-user"}.target
"""


_SYSTEM = f"""\
# Compiled code is kept below XDG_CACHE_HOME.
User={USER}
Group={USER}
SupplementaryGroups=video
StateDirectory={STATE_FOLDER.name}
CacheDirectory={STATE_FOLDER.name}
Environment=XDG_CACHE_HOME=/var/cache/{STATE_FOLDER.name}
UMask=0077
Nice=-5
CapabilityBoundingSet=
ProtectSystem=strict
ProtectHome=yes
PrivateTmp=yes
ProtectProc=invisible
ProtectClock=yes
ProtectHostname=yes
ProtectKernelLogs=yes
ProtectKernelModules=yes
ProtectKernelTunables=yes
ProtectControlGroups=yes
RestrictAddressFamilies=AF_UNIX AF_INET AF_INET6 AF_NETLINK
RestrictNamespaces=yes
RestrictRealtime=yes
RestrictSUIDSGID=yes
LockPersonality=yes
RemoveIPC=yes
SystemCallArchitectures=native
# Not MemoryDenyWriteExecute: the detector is compiled when it starts. Not PrivateDevices: the camera is one.
"""


def _command(service: Service) -> str:
    words = [str(service.python), "-P", "-m", "rhot_node", "--settings", str(service.settings), "--camera",
             service.camera]
    return " ".join(_quoted(word) for word in words)


def _quoted(word: str) -> str:
    """A word of a command line as systemd reads it: % and $ stand for themselves only when doubled."""
    if not word.isprintable():
        raise NodeError(f"{printable(word)!r} cannot stand in a service: it has a line break or another control "
                        "character.")
    word = word.replace("%", "%%").replace("$", "$$")
    if word and all(character.isalnum() or character in "/._-:?=%$,+@" for character in word):
        return word
    escaped = word.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'


# -- installation and removal ------------------------------------------------------------------------------------------

SETTINGS = STATE_FOLDER / "node.json"
UNIT_FOLDER = Path("/etc/systemd/system")
PRIVATE_HOMES = ("/home", "/root")


def run_command(command: Sequence[str]) -> str | None:
    """Run `command`; None when it succeeds, else what it complained of."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=START_S + WATCHDOG_S)
    except (OSError, subprocess.TimeoutExpired) as exc:
        return str(exc)
    return None if done.returncode == 0 else (done.stderr or done.stdout).strip()


@dataclass(frozen=True)
class Host:
    """The machine to install on."""

    root: Path = Path("/")
    run: Callable[[Sequence[str]], str | None] = run_command
    is_root: bool = field(default_factory=lambda: os.geteuid() == 0)
    home: Path = field(default_factory=Path.home)
    prefix: Path = field(default_factory=lambda: Path(sys.prefix))
    python: Path = field(default_factory=lambda: Path(sys.executable))

    def at(self, path: Path) -> Path:
        """Where `path` lies below the root."""
        return self.root / path.relative_to("/")


@dataclass(frozen=True)
class Wish:
    """What to install. `settings` is a file to take over; else a new one gets `node_id` and `name`."""

    camera: str = "pi"
    settings: Path | None = None
    node_id: int | None = None
    name: str | None = None
    user: bool = False


def service_for(wish: Wish, host: Host) -> Service:
    """The service that `wish` asks for on `host`."""
    settings = host.home / ".config" / "rhot-node" / "node.json" if wish.user else SETTINGS
    return Service(host.python, settings, wish.camera, wish.user)


def install(wish: Wish, host: Host, say: Callable[[str], None]) -> None:
    """Write settings and unit, start the service and wait until the node is ready. May be repeated, to change the
    camera or after an update. Raises NodeError saying what to do; what is already in place then stays."""
    service = service_for(wish, host)
    settings = service.settings if wish.user else host.at(service.settings)
    if not wish.user:
        _check_system(host)
    new = _new_settings(wish, settings)
    if not wish.user and host.run(["id", "-u", USER]) is not None:
        _do(host, "useradd", "--system", "--user-group", "--no-create-home", "--home-dir", str(STATE_FOLDER),
            "--shell", "/usr/sbin/nologin", "--groups", "video", USER)
        say(f"made the user {USER}, who may use cameras and owns nothing else")
    if new is not None:
        settings.parent.mkdir(parents=True, exist_ok=True)
        save_settings(settings, new)
        say(f"wrote {settings}: node {new.node_id}, {new.name!r}")
    if not wish.user:
        _do(host, "chown", "-R", f"{USER}:{USER}", str(STATE_FOLDER))
    unit = _unit_path(wish.user, host)
    unit.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(unit, unit_text(service).encode())
    say(f"wrote {unit}")
    _systemctl(host, wish.user, "daemon-reload")
    _systemctl(host, wish.user, "enable", NAME)
    say("starting the node; the first time its code is compiled, which takes one to five minutes")
    failure = host.run(["systemctl", *(["--user"] if wish.user else []), "restart", NAME])
    if failure is not None:
        raise NodeError(f"the service is installed, but the node did not get ready ({failure}). Its own words: "
                        f"`journalctl {'--user ' if wish.user else ''}-u {NAME} -n 30`; then `rhot-node doctor`.")
    say("the node is ready, and will be after every start of this machine")


def uninstall(user: bool, host: Host, say: Callable[[str], None]) -> None:
    """Stop the service and remove its unit; settings and keys stay. Raises NodeError when there is none."""
    unit = _unit_path(user, host)
    if not unit.exists():
        raise NodeError(f"{unit}: no such service, so there is nothing to remove"
                        f"{'' if user else ' (a service of one user: rhot-node uninstall --user)'}.")
    if not user and not host.is_root:
        raise NodeError(f"only root may remove a system service: sudo {host.python} -m rhot_node uninstall")
    _systemctl(host, user, "disable", "--now", NAME)
    unit.unlink()
    _systemctl(host, user, "daemon-reload")
    say(f"removed {unit}")
    if user:
        say(f"settings and keys stay in {host.home / '.config' / 'rhot-node'}")
    else:
        say(f"settings and keys stay; to remove them too: sudo rm -r {STATE_FOLDER} /var/cache/{STATE_FOLDER.name} && "
            f"sudo userdel {USER}")


def _check_system(host: Host) -> None:
    if not host.is_root:
        raise NodeError(f"only root may install a system service: sudo {host.python} -m rhot_node install ... (or "
                        "--user for a service of your own, or --dry-run to see what would be written)")
    for home in PRIVATE_HOMES:
        if host.prefix.is_relative_to(home):
            raise NodeError(f"this environment lies in {host.prefix}, which the service's user may not read. Install "
                            "RHOT in /opt/rhot (docs/pi.md), or use --user.")


def _new_settings(wish: Wish, target: Path) -> NodeSettings | None:
    """Settings to write; None when the ones in place stay."""
    if wish.settings is not None:
        return load_settings(wish.settings)
    if target.exists():
        load_settings(target)
        return None
    if wish.node_id is None or wish.name is None:
        raise NodeError("a new node needs --node-id and --name, as in the rig file (such as --node-id 1 --name left), "
                        "or --settings FILE to take over.")
    markers = load_markers(resource_path("markers", "rhot6.json"))
    return changed_settings(NodeSettings(1, "node", markers), {"node_id": wish.node_id, "name": wish.name})


def _unit_path(user: bool, host: Host) -> Path:
    return host.home / ".config" / "systemd" / "user" / NAME if user else host.at(UNIT_FOLDER) / NAME


def _systemctl(host: Host, user: bool, *words: str) -> None:
    _do(host, "systemctl", *(["--user"] if user else []), *words)


def _do(host: Host, *command: str) -> None:
    failure = host.run(command)
    if failure is not None:
        raise NodeError(f"`{' '.join(command)}` failed: {failure}")


# -- what the running node says (sd_notify(3)) -------------------------------------------------------------------------

class ServiceManager:
    """Says that the node is ready and, often enough, that it is alive. Silent where nobody asked for it."""

    def __init__(self, environment: Mapping[str, str] = os.environ,
                 now_s: Callable[[], float] = time.monotonic) -> None:
        """Reads NOTIFY_SOCKET, WATCHDOG_USEC and WATCHDOG_PID."""
        address = environment.get("NOTIFY_SOCKET", "")
        self._address = f"\0{address[1:]}" if address.startswith("@") else address
        watched = environment.get("WATCHDOG_PID", str(os.getpid())) == str(os.getpid())
        microseconds = environment.get("WATCHDOG_USEC", "")
        # A third of what the manager waits for: one sign may be late.
        self._period_s = 1e-6 * int(microseconds) / 3 if watched and microseconds.isdigit() else None
        self._now_s = now_s
        self._due_s = 0.0
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC) if address else None

    def ready(self, status: str) -> None:
        """The node can be used from now on."""
        self._say(f"READY=1\nSTATUS={status}")

    def alive(self) -> None:
        """The node's loop goes round; called at every turn, says so only when it is due."""
        if self._period_s is not None and self._now_s() >= self._due_s:
            self._due_s = self._now_s() + self._period_s
            self._say("WATCHDOG=1")

    def stopping(self) -> None:
        """The node ends. Nothing is said after this."""
        self._say("STOPPING=1")
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _say(self, text: str) -> None:
        if self._socket is not None:
            with contextlib.suppress(OSError):  # a manager that went away or is busy must not hold the node up
                self._socket.sendto(text.encode(), socket.MSG_DONTWAIT, self._address)
