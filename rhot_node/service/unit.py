"""The text of the node's systemd unit. Pure."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

NAME = "rhot-node.service"
USER = "rhot-node"
STATE_FOLDER = Path("/var/lib/rhot-node")
WATCHDOG_S = 20
START_S = 900  # the first start compiles; on a Pi 3 that takes minutes
MEMORY_MAX_MB = 700  # compiling takes 360 to 430 MB, running 225


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
    word = word.replace("%", "%%").replace("$", "$$")
    if word and all(character.isalnum() or character in "/._-:?=%$,+@" for character in word):
        return word
    escaped = word.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
