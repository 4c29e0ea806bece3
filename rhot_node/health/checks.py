"""What the kernel and the firmware tell of a machine, and what it means for a node: one function per thing, from values
to a `Check`. Every file that is read lies below a root passed in."""

from __future__ import annotations

import re
import shutil
import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntFlag
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rhot_node.files import KIB, MIB

# -- the machine -------------------------------------------------------------------------------------------------------

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


# -- result of a check -------------------------------------------------------------------------------------------------

Level = Literal["ok", "unknown", "warning", "error"]
LEVELS: tuple[Level, ...] = ("ok", "unknown", "warning", "error")
"""Unknown is what the machine does not tell: nothing is wrong as far as can be seen."""


@dataclass(frozen=True, slots=True)
class Check:
    """`code` is a short key, `text` a sentence on what was found, `remedy` one on what to do; empty when there is no
    trouble."""

    code: str
    level: Level
    text: str
    remedy: str = ""

    @property
    def is_trouble(self) -> bool:
        """Whether something is not as it should be."""
        return self.level in ("warning", "error")

    @property
    def sentence(self) -> str:
        """What was found and what to do."""
        return f"{self.text} {self.remedy}".rstrip()


def worst(checks: list[Check]) -> Level:
    """The highest level among `checks`; ok for none."""
    return max((check.level for check in checks), key=LEVELS.index, default="ok")


# -- checks of a machine's values --------------------------------------------------------------------------------------

HOT_C = 75.0
TOO_HOT_C = 80.0  # here the firmware begins to slow the processor down
MEMORY_LOW = 150 * MIB  # bytes; a node takes up to 250 MB when it starts anew
MEMORY_OUT = 50 * MIB
RECEIVE_BUFFER_MIN = 128 * KIB  # bytes; a node is sent a few datagrams per second
POWER_REMEDY = ("Use the board's own power supply (5.1 V; 3 A, for a Pi 5 5 A) with its own cable, and take other USB "
                "devices off.")
COOL_REMEDY = "Give it a heat sink or a fan and free air; a closed case needs a fan."
NOW = Throttled.UNDER_VOLTAGE | Throttled.CAPPED | Throttled.THROTTLED | Throttled.HOT


BLACK_LUMA = 32  # grey levels: twice the black of video range (ITU-R BT.601: 16)
BLACK_SHARE = 99.0  # per cent of the pixels; a lamp's reflection on a lens cap is smaller than the rest
BLACK_PICTURE = Check("black", "warning", "Its camera's picture is black.", "Is the lens covered?")
STEP_PX = 8  # from pixel to pixel of a picture that is judged


def is_black(luma: NDArray[np.uint8]) -> bool:
    """Whether a picture (H, W) shows nothing at all: its lens is covered, or there is no light."""
    return bool(np.percentile(luma[::STEP_PX, ::STEP_PX], BLACK_SHARE) < BLACK_LUMA)


def check_power(flags: Throttled | None) -> Check:
    """Under-voltage: now, or since the machine was switched on."""
    if flags is None:
        return Check("power", "unknown", "This machine does not tell whether its power supply is strong enough.")
    if flags & Throttled.UNDER_VOLTAGE:
        return Check("power", "error", "Its supply voltage is too low now (below 4.63 V): it is slowed down and may "
                     "stop or damage its SD card.", POWER_REMEDY)
    if flags & Throttled.UNDER_VOLTAGE_BEFORE:
        return Check("power", "warning", "Its supply voltage was too low at least once since it was switched on.",
                     POWER_REMEDY)
    return Check("power", "ok", "The supply voltage has been high enough since it was switched on.")


def check_heat(temperature_c: float | None, flags: Throttled | None) -> Check:
    """Temperature, and whether the firmware slows the processor down because of it."""
    flags = flags or Throttled(0)
    heat = "" if temperature_c is None else f" at {temperature_c:.0f} °C"
    slowed = flags & (Throttled.THROTTLED | Throttled.HOT) and not flags & Throttled.UNDER_VOLTAGE
    if slowed or (temperature_c or 0.0) >= TOO_HOT_C:
        return Check("heat", "error", f"Its processor is too hot{heat} and is slowed down: frames come late.",
                     COOL_REMEDY)
    if (temperature_c or 0.0) >= HOT_C:
        return Check("heat", "warning", f"Its processor is hot{heat}; at {TOO_HOT_C:.0f} °C it is slowed down.",
                     COOL_REMEDY)
    if flags & Throttled.HOT_BEFORE:
        return Check("heat", "warning", f"Its processor{heat} was slowed down by heat since it was switched on.",
                     COOL_REMEDY)
    if not heat:
        return Check("heat", "unknown", "It does not tell its temperature.")
    return Check("heat", "ok", f"The processor is cool enough{heat}.")


def check_memory(available_bytes: int | None) -> Check:
    """Memory that is left."""
    if available_bytes is None:
        return Check("memory", "unknown", "It does not tell how much memory is free.")
    text = f"{available_bytes / MIB:.0f} MB of memory are free"
    if available_bytes < MEMORY_LOW:
        return Check("memory", "error" if available_bytes < MEMORY_OUT else "warning", f"Only {text}.",
                     "End other programs, or use the Lite system without a desktop.")
    return Check("memory", "ok", f"{text}.")


def check_memory_limit(limits: bool) -> Check:
    """Whether the service's memory limit means anything."""
    if limits:
        return Check("memory_limit", "ok", "The kernel holds services to their memory limits.")
    return Check("memory_limit", "warning", "The kernel does not hold the service to its memory limit.",
                 "Add `cgroup_enable=memory` to the line in /boot/firmware/cmdline.txt and restart.")


def check_clock(synchronised: bool | None, source: str | None) -> Check:
    """The clocks. A node's times are of the monotonic clock, which no time service sets."""
    if source == "jiffies":
        return Check("clock", "error", "The kernel counts time by its timer's ticks, 4 to 10 ms apart, for want of a "
                     "better clock.", "Use the system's own kernel for this board.")
    wall = {True: "follows the network's", False: "does not follow the network's",
            None: "may or may not follow the network's"}[synchronised]
    text = (f"The wall clock {wall}; that does not matter: a node's times are of the monotonic clock, which is never "
            "set. (Only the camera setting `sync` needs wall clocks that agree.)")
    return Check("clock", "ok" if source else "unknown", text)


def check_speed(governor: str | None) -> Check:
    """The processor's frequency."""
    if governor == "powersave":
        return Check("speed", "warning", "The processor is held at its lowest frequency.",
                     "Set it free: `echo ondemand | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor`.")
    if not governor:
        return Check("speed", "unknown", "It does not tell how its processor's frequency is chosen.")
    return Check("speed", "ok", f"The processor's frequency is chosen by {governor}.")


def check_network(machine: Machine) -> list[Check]:
    """Whether datagrams get out on time."""
    interfaces = machine.interfaces()
    if not interfaces:
        return [Check("network", "error", "No network interface is up.", "Plug in a network cable.")]
    names = ", ".join(f"{interface.name} ({'wireless' if interface.wireless else 'cable'})" for interface in interfaces)
    found = [Check("network", "ok", f"Up: {names}.")]
    if all(interface.wireless for interface in interfaces):
        found = [Check("network", "warning", f"Only wireless is up: {names}; frames will come late and get lost at "
                       "times.", "Use a cable.")]
    for interface in interfaces:
        if interface.power_save:
            found.append(Check("power_save", "warning", f"{interface.name} sleeps between packets, which delays them "
                               "by up to 0.1 s.", f"Switch it off: `sudo iw dev {interface.name} set power_save off` "
                               "(for good: docs/pi.md)."))
    buffer = machine.receive_buffer_max()
    if buffer is not None and buffer < RECEIVE_BUFFER_MIN:
        found.append(Check("receive_buffer", "warning", f"Sockets may buffer {buffer // KIB} KiB only.",
                           "Allow more: `sudo sysctl -w net.core.rmem_max=212992`."))
    return found


# -- health as reported to the master ----------------------------------------------------------------------------------

LOOK_S = 2.0  # between looks at the machine, however often it is asked
RECENT_S = 60.0  # a brown-out between two looks is told for so long


class HealthMonitor:
    """Looks at the machine when asked, which is in the control channel's thread: the frame loop pays nothing."""

    def __init__(self, machine: Machine, now_s: Callable[[], float] = time.monotonic) -> None:
        self._machine = machine
        self._now_s = now_s
        self._lock = threading.Lock()
        self._known = machine.throttled(ask_commands=False) or Throttled(0)  # what had been before the node started
        self._noticed: dict[Throttled, float] = {}
        self._troubles: list[Check] = []
        self._looked_s = -LOOK_S

    def troubles(self) -> list[Check]:
        """Everything that is not as it should be; empty on a well machine."""
        with self._lock:
            now_s = self._now_s()
            if now_s - self._looked_s >= LOOK_S:
                self._looked_s = now_s
                self._troubles = self._look(now_s)
            return self._troubles

    def _look(self, now_s: float) -> list[Check]:
        flags = self._machine.throttled(ask_commands=False)
        if flags is not None:
            for flag in flags & ~self._known & ~NOW:
                self._noticed[flag] = now_s
            self._known |= flags
            recent = [flag for flag, noticed_s in self._noticed.items() if now_s - noticed_s < RECENT_S]
            flags &= NOW
            for flag in recent:
                flags |= flag
        checks = (check_power(flags), check_heat(self._machine.temperature_c(), flags),
                  check_memory(self._machine.available_bytes()))
        return [check for check in checks if check.is_trouble]
