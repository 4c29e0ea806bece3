"""A machine's /proc, /sys, /run and /dev as files below a folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rhot_node.health.checks import Machine

WELL: dict[str, str] = {
    "proc/device-tree/model": "Raspberry Pi 4 Model B Rev 1.4\0",
    "proc/meminfo": "MemTotal:        3884360 kB\nMemFree:          100000 kB\nMemAvailable:    3000000 kB\n",
    "proc/sys/net/core/rmem_max": "212992\n",
    "sys/devices/platform/soc/soc:firmware/get_throttled": "0\n",
    "sys/class/thermal/thermal_zone0/type": "cpu-thermal\n",
    "sys/class/thermal/thermal_zone0/temp": "51121\n",
    "sys/devices/system/clocksource/clocksource0/current_clocksource": "arch_sys_counter\n",
    "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor": "ondemand\n",
    "sys/fs/cgroup/cgroup.controllers": "cpuset cpu io memory pids\n",
    "sys/class/net/lo/operstate": "unknown\n",
    "sys/class/net/eth0/operstate": "up\n",
    "sys/class/net/wlan0/operstate": "down\n",
    "sys/class/net/wlan0/wireless/x": "",
    "run/systemd/timesync/clock": "",
    "run/systemd/timesync/synchronized": "",
    "dev/video0": "",
}


def machine(root: Path, changes: dict[str, str | None] | None = None,
            commands: dict[str, str] | None = None) -> Machine:
    """A well Pi 4 with `changes`: file contents, None for no such file; `commands`: what they print."""
    for name, text in (WELL | (changes or {})).items():
        path = root / name
        if text is None:
            path.unlink(missing_ok=True)
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)

    def run(command: Sequence[str]) -> str | None:
        return (commands or {}).get(" ".join(command))

    return Machine(root, run)
