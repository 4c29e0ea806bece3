"""The machine's state from fake /proc and /sys trees: readings, what they mean, what the daemon tells of them."""

from __future__ import annotations

from pathlib import Path

import pytest
from machine_fake import machine

from rhot_node.health.checks import (
    LOOK_S,
    RECENT_S,
    Check,
    HealthMonitor,
    Machine,
    Throttled,
    check_clock,
    check_heat,
    check_memory,
    check_network,
    check_power,
    check_speed,
    run_command,
    worst,
)

FIRMWARE = "sys/devices/platform/soc/soc:firmware/get_throttled"
FIRMWARE_PI5 = "sys/devices/platform/soc@107c000000/soc@107c000000:firmware/get_throttled"
SENSOR = "sys/class/hwmon/hwmon2"
TEMPERATURE = "sys/class/thermal/thermal_zone0/temp"


def test_a_well_machine_is_read_whole(tmp_path: Path) -> None:
    pi = machine(tmp_path)
    assert pi.model() == "Raspberry Pi 4 Model B Rev 1.4"
    assert pi.throttled() == Throttled(0)
    assert pi.temperature_c() == pytest.approx(51.121)
    assert pi.available_bytes() == 3_000_000 * 1024
    assert pi.ntp_synchronised() is True and pi.clock_source() == "arch_sys_counter"
    assert [(i.name, i.wireless) for i in pi.interfaces()] == [("eth0", False)]
    assert pi.video_devices() == ["/dev/video0"] and pi.limits_memory()


def test_an_empty_machine_tells_nothing_and_nothing_breaks(tmp_path: Path) -> None:
    bare = Machine(tmp_path, lambda _command: None)
    assert (bare.model(), bare.throttled(), bare.temperature_c(), bare.available_bytes()) == (None,) * 4
    assert bare.ntp_synchronised() is None and bare.interfaces() == [] and bare.video_devices() == []
    checks = [check_power(None), check_heat(None, None), check_memory(None), check_clock(None, None), check_speed(None)]
    assert {check.level for check in checks} == {"unknown"} and worst(checks) == "unknown"
    assert HealthMonitor(bare).troubles() == []


@pytest.mark.parametrize(("changes", "commands", "flags"), [
    ({FIRMWARE: "50005\n"}, {}, 0x50005),
    ({FIRMWARE: None, FIRMWARE_PI5: "10000\n"}, {}, 0x10000),
    ({FIRMWARE: None}, {"vcgencmd get_throttled": "throttled=0x80008\n"}, 0x80008),
    ({FIRMWARE: None, f"{SENSOR}/name": "rpi_volt\n", f"{SENSOR}/in0_lcrit_alarm": "1\n"}, {}, 1),
    ({FIRMWARE: "nonsense"}, {}, None)])
def test_brown_outs_are_read_wherever_the_machine_tells(tmp_path: Path, changes: dict[str, str | None],
                                                        commands: dict[str, str], flags: int | None) -> None:
    found = machine(tmp_path, changes, commands).throttled()
    assert found == (None if flags is None else Throttled(flags))


@pytest.mark.parametrize(("flags", "level", "word"), [
    (0x0, "ok", "high enough"), (0x50005, "error", "now"), (0x10000, "warning", "at least once"), (0x8, "ok", "high")])
def test_power(flags: int, level: str, word: str) -> None:
    check = check_power(Throttled(flags))
    assert check.level == level and word in check.text
    assert ("power supply" in check.remedy) == (level != "ok")


@pytest.mark.parametrize(("celsius", "flags", "level"), [
    (51.0, 0, "ok"), (76.0, 0, "warning"), (80.5, 0, "error"), (70.0, 0x8, "error"), (60.0, 0x80000, "warning"),
    (50.0, 0x50005, "ok"), (None, 0x4, "error")])
def test_heat(celsius: float | None, flags: int, level: str) -> None:
    """Throttling by a weak supply is not heat."""
    assert check_heat(celsius, Throttled(flags)).level == level


@pytest.mark.parametrize(("megabytes", "level"), [(3000, "ok"), (149, "warning"), (49, "error")])
def test_memory(megabytes: int, level: str) -> None:
    check = check_memory(megabytes << 20)
    assert check.level == level and f"{megabytes} MB" in check.text


def test_clocks(tmp_path: Path) -> None:
    """The wall clock does not matter; a kernel that counts ticks does."""
    wrong = machine(tmp_path, {"run/systemd/timesync/synchronized": None})
    assert wrong.ntp_synchronised() is False
    check = check_clock(wrong.ntp_synchronised(), wrong.clock_source())
    assert check.level == "ok" and "does not follow" in check.text and "does not matter" in check.text
    assert check_clock(True, "jiffies").level == "error"


def test_network(tmp_path: Path) -> None:
    assert [check.level for check in check_network(machine(tmp_path / "cable"))] == ["ok"]
    wireless = machine(tmp_path / "wireless", {
        "sys/class/net/eth0/operstate": "down", "sys/class/net/wlan0/operstate": "up",
        "proc/sys/net/core/rmem_max": "65536"}, {"iw dev wlan0 get power_save": "Power save: on\n"})
    found = {check.code: check for check in check_network(wireless)}
    assert [check.level for check in found.values()] == ["warning"] * 3
    assert "Use a cable" in found["network"].remedy and "set power_save off" in found["power_save"].remedy
    assert "64 KiB" in found["receive_buffer"].text
    gone = machine(tmp_path / "none", {"sys/class/net/eth0/operstate": "down"})
    assert check_network(gone)[0].level == "error"


def test_a_processor_held_slow_is_named(tmp_path: Path) -> None:
    pi = machine(tmp_path, {"sys/devices/system/cpu/cpu0/cpufreq/scaling_governor": "powersave"})
    assert check_speed(pi.governor()).level == "warning"


def test_commands_that_are_not_there_or_fail_are_none() -> None:
    assert run_command(["rhot-no-such-command"]) is None
    assert run_command(["false"]) is None
    assert run_command(["echo", "on"]) == "on\n"


def test_the_worst_counts() -> None:
    checks = [Check("a", "ok", "."), Check("b", "error", ".", "Do."), Check("c", "warning", ".")]
    assert worst(checks) == "error" and worst([]) == "ok"
    assert checks[1].sentence == ". Do." and checks[0].sentence == "."


class Time:
    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def test_the_daemon_tells_of_trouble_until_it_is_over(tmp_path: Path) -> None:
    time = Time()
    monitor = HealthMonitor(machine(tmp_path), time)
    assert monitor.troubles() == []
    (tmp_path / TEMPERATURE).write_text("82000")
    (tmp_path / FIRMWARE).write_text("50005")
    assert monitor.troubles() == [], "it looks only so often"
    time.now_s += LOOK_S
    assert {check.code: check.level for check in monitor.troubles()} == {"power": "error", "heat": "error"}
    (tmp_path / TEMPERATURE).write_text("60000")
    (tmp_path / FIRMWARE).write_text("50000")
    time.now_s += LOOK_S
    assert {check.code: check.level for check in monitor.troubles()} == {"power": "warning"}, "it was a moment ago"
    time.now_s += RECENT_S
    assert monitor.troubles() == []


def test_what_had_been_before_the_node_started_is_not_told(tmp_path: Path) -> None:
    assert HealthMonitor(machine(tmp_path, {FIRMWARE: "50000"}), Time()).troubles() == []
