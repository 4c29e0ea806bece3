"""What the kernel and the firmware tell of a machine, as plain values. Every file lies below a root passed in."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntFlag
from pathlib import Path

from rhot_node.files import KIB

COMMAND_S = 2.0
Run = Callable[[Sequence[str]], str | None]
"""Runs a command; its standard output, None when it is not there or fails."""


class Throttled(IntFlag):
    """The firmware's flags, as of ``vcgencmd get_throttled``. The higher ones stay set until the machine restarts."""

    UNDER_VOLTAGE = 1 << 0
    CAPPED = 1 << 1
    THROTTLED = 1 << 2
    HOT = 1 << 3
    UNDER_VOLTAGE_BEFORE = 1 << 16
    CAPPED_BEFORE = 1 << 17
    THROTTLED_BEFORE = 1 << 18
    HOT_BEFORE = 1 << 19


@dataclass(frozen=True, slots=True)
class Interface:
    """A network interface that is up. `power_save` is None for a cable, or where nobody tells."""

    name: str
    wireless: bool
    power_save: bool | None


def run_command(command: Sequence[str]) -> str | None:
    """Run `command` for at most COMMAND_S."""
    if shutil.which(command[0]) is None:
        return None
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=COMMAND_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout if done.returncode == 0 else None


class Machine:
    """Reads below `root`, which is "/" but for tests. A method returns None where the machine does not tell."""

    def __init__(self, root: Path = Path("/"), run: Run = run_command) -> None:
        self.root = root
        self.run = run

    def model(self) -> str | None:
        """Name of the board, such as "Raspberry Pi 4 Model B Rev 1.4"."""
        return self._text("proc/device-tree/model")

    def throttled(self, *, ask_commands: bool = True) -> Throttled | None:
        """The firmware's flags; from the kernel's voltage sensor where the firmware's own are not to be had."""
        for path in sorted(self.root.glob("sys/devices/platform/soc*/soc*:firmware/get_throttled")):
            value = _hex(self._text(str(path.relative_to(self.root))))
            if value is not None:
                return Throttled(value)
        if ask_commands:
            value = _hex((self.run(["vcgencmd", "get_throttled"]) or "").partition("=")[2].strip())
            if value is not None:
                return Throttled(value)
        for path in self.root.glob("sys/class/hwmon/hwmon*"):
            name = path.relative_to(self.root)
            if self._text(f"{name}/name") == "rpi_volt":
                return Throttled.UNDER_VOLTAGE if self._number(f"{name}/in0_lcrit_alarm") else Throttled(0)
        return None

    def temperature_c(self) -> float | None:
        """Of the processor, degrees Celsius."""
        for path in sorted(self.root.glob("sys/class/thermal/thermal_zone*")):
            name = path.relative_to(self.root)
            if self._text(f"{name}/type") in ("cpu-thermal", "cpu_thermal", "x86_pkg_temp"):
                value = self._number(f"{name}/temp")
                return None if value is None else value / 1000.0
        return None

    def available_bytes(self) -> int | None:
        """Memory that a program could still get."""
        found = re.search(r"^MemAvailable:\s*(\d+) kB$", self._text("proc/meminfo") or "", re.MULTILINE)
        return None if found is None else KIB * int(found[1])

    def limits_memory(self) -> bool:
        """Whether the kernel can hold a service to its memory limit; Raspberry Pi OS has that off."""
        return "memory" in (self._text("sys/fs/cgroup/cgroup.controllers") or "").split()

    def ntp_synchronised(self) -> bool | None:
        """Whether the wall clock follows the network's."""
        if (self.root / "run/systemd/timesync").is_dir():
            return (self.root / "run/systemd/timesync/synchronized").exists()
        answer = self.run(["timedatectl", "show", "--property=NTPSynchronized", "--value"])
        return None if answer is None else answer.strip() == "yes"

    def clock_source(self) -> str | None:
        """What the kernel's clocks count by."""
        return self._text("sys/devices/system/clocksource/clocksource0/current_clocksource")

    def governor(self) -> str | None:
        """How the processor's frequency is chosen."""
        return self._text("sys/devices/system/cpu/cpu0/cpufreq/scaling_governor")

    def interfaces(self) -> list[Interface]:
        """The network interfaces that are up, without the loopback."""
        found = []
        for path in sorted(self.root.glob("sys/class/net/*")):
            if path.name != "lo" and self._text(f"sys/class/net/{path.name}/operstate") == "up":
                wireless = (path / "wireless").exists() or (path / "phy80211").exists()
                found.append(Interface(path.name, wireless, self._power_save(path.name) if wireless else None))
        return found

    def receive_buffer_max(self) -> int | None:
        """Largest receive buffer that a socket may ask for, bytes."""
        value = self._number("proc/sys/net/core/rmem_max")
        return None if value is None else int(value)

    def video_devices(self) -> list[str]:
        """The video devices there are, such as /dev/video0."""
        return sorted(f"/{path.relative_to(self.root)}" for path in self.root.glob("dev/video*"))

    def _power_save(self, interface: str) -> bool | None:
        answer = self.run(["iw", "dev", interface, "get", "power_save"])
        return None if answer is None else answer.strip().endswith("on")

    def _number(self, name: str) -> float | None:
        try:
            return float(self._text(name) or "")
        except ValueError:
            return None

    def _text(self, name: str) -> str | None:
        try:
            return (self.root / name).read_text(errors="replace").strip("\0\n ")
        except OSError:
            return None


def _hex(text: str | None) -> int | None:
    """The kernel writes the flags without 0x, the firmware's command with it."""
    try:
        return int(text or "", 16)
    except ValueError:
        return None
