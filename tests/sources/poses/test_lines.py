"""The line protocol: what is a pose, whose time it has, and what is said of the rest; from programs and sockets."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from patience import eventually

from rhot_app.__main__ import main
from rhot_app.errors import SourceError
from rhot_app.objects.pose import Validity
from rhot_app.objects.stream import read_pose_stream
from rhot_app.sources.poses.lines import LINE_MAX, SILENCE_NS, WINDOW_S, ArrivalClock, LinePoses, parse_line
from rhot_app.sources.poses.open_source import ProgramLines, TcpLines, UdpLines, open_source
from rhot_node import compiled

LINE = b"1.5 T20 0.1 -0.2 0.3 0 1 0 0"


class Nothing:
    """An input that a test goes round."""

    name, end = "program", ""

    def read(self) -> bytes:
        return b""

    def close(self) -> None:
        self.end = "over."


def line_poses(device: str = "") -> LinePoses:
    return LinePoses(Nothing(), device, lambda: 0)


@pytest.mark.parametrize("line", [LINE, LINE + b"\r", b"1.5 T20 POSE 0.1 -0.2 0.3 0.0 1.0 0.0 0.0 \r"])
def test_a_pose_is_read(line: bytes) -> None:
    read = parse_line(line)
    assert read is not None and (read.t_s, read.device) == (1.5, "T20")
    np.testing.assert_allclose(read.world_from_body, [[1, 0, 0, 0.1], [0, -1, 0, -0.2], [0, 0, -1, 0.3], [0, 0, 0, 1]],
                               atol=1e-12)


@pytest.mark.parametrize("line", [b"", b"  \r", b"Info: Loaded drivers: HTCVive", b"OPTION record s x",
                                  b"0.2 T20 VELOCITY 0 0 0 0 0 0", b"0.1 INFO LOG something",
                                  b"0 0 LH_POSE 0 0 0 1 0 0 0"])
def test_other_records_are_passed_over(line: bytes) -> None:
    assert parse_line(line) is None


@pytest.mark.parametrize("line", [b"hello", b"1.5 T20 0.1 0.2", LINE + b" 7", b"x T20 0 0 0 1 0 0 0", b"\xff\x00" * 30,
                                  b"1.5 T20 nan 0 0 1 0 0 0", b"1.5 T20 0 0 0 0 0 0 0", b"1.5 T20 5000 0 0 1 0 0 0",
                                  b"inf T20 0 0 0 1 0 0 0", b"1.5 T20 0 0 zero 1 0 0 0"])
def test_garbage_is_counted_and_said_and_the_rest_goes_on(line: bytes) -> None:
    source = line_poses()
    poses = source.take(line + b"\n" + LINE + b"\n", 10**12)
    assert len(poses) == 1 and source.unreadable == 1
    assert "1 lines are no poses" in source.notice and source.notice.isprintable()


def test_lines_come_in_pieces_and_one_without_an_end_is_thrown_away() -> None:
    source = line_poses()
    assert source.take(LINE[:7], 10**12) == [] and len(source.take(LINE[7:] + b"\n", 10**12)) == 1
    for _ in range(5):
        assert source.take(b"9" * LINE_MAX, 10**12) == []
    assert source.unreadable == 1
    assert len(source.take(b"9\n2.5 T20 0 0 0 1 0 0 0\n", 2 * 10**12)) == 1


def test_the_first_tracker_or_the_chosen_one_is_followed() -> None:
    data = LINE + b"\n" + LINE.replace(b"T20", b"T21").replace(b"0.3", b"0.9") + b"\n"
    first, chosen, absent = line_poses(), line_poses("T21"), LinePoses(Nothing(), "T7", lambda: 2 * SILENCE_NS)
    assert [pose.world_from_body[2, 3] for pose in first.take(data, 10**12)] == [0.3] and first.others == 1
    assert [pose.world_from_body[2, 3] for pose in chosen.take(data, 10**12)] == [0.9]
    absent._heard_ns = 0
    assert absent.take(data, 10**12) == [] and "no pose of T7" in absent.notice and "T21" in absent.notice


@pytest.mark.parametrize(("drift", "burst"), [(0.0, 1), (50e-6, 1), (-50e-6, 1), (0.0, 40)])
def test_times_are_the_masters_but_for_a_constant(drift: float, burst: int) -> None:
    """Delays of 2 ms and more, exponential as a busy machine's; in bursts as from a buffer of 4 kB."""
    rng, clock = np.random.default_rng(4), ArrivalClock()
    true_s = np.arange(0.0, 60.0, 0.008)
    theirs_s = 500.0 + true_s * (1.0 + drift)
    delay_s = 0.002 + rng.exponential(0.004, len(true_s))
    errors = []
    for start in range(0, len(true_s) - burst + 1, burst):
        group = slice(start, start + burst)
        arrival_ns = round(1e9 * (true_s[group][-1] + delay_s[group][-1]))
        for t_s in theirs_s[group]:
            clock.observe(t_s, arrival_ns)
        errors += [1e-9 * clock.master_ns(t_s) - t for t_s, t in zip(theirs_s[group], true_s[group], strict=True)]
    late = np.array(errors[int(WINDOW_S / 0.008):])
    print(f"drift {1e6 * drift:+.0f} ppm, bursts of {burst}: {1e3 * late.mean():.2f} ms late, "
          f"sd {1e3 * late.std():.3f} ms")
    assert 0.001 < late.mean() < 0.004 and late.std() < 0.5e-3


def test_a_clock_that_was_set_back_begins_anew_and_a_late_line_is_left_out() -> None:
    source = line_poses()
    assert len(source.take(b"100 T 0 0 0 1 0 0 0\n", 10**12)) == 1
    (pose,) = source.take(b"1 T 0 0 0 1 0 0 0\n", 2 * 10**12)
    assert pose.t_master_ns == 2 * 10**12
    assert source.take(b"1 T 0 0 0 1 0 0 0\n", 2 * 10**12) == [] and source.late == 1


PROGRAM = """
import sys, time
began = time.monotonic()
for k in range({count}):
    time.sleep(max(0.0, began + 0.005 * k - time.monotonic()))
    t_s = time.monotonic() - began
    print(f"{{t_s:.6f}} T20 POSE {{0.1 * (t_s % 1000.0)}} 0 0.5 1 0 0 0", flush=True)
    if k % 10 == 3:
        print("garbage \\x1b[2J", flush=True)
print("the base station is gone", file=sys.stderr)
sys.exit({code})
"""


def program(folder: Path, count: int = 100, code: int = 3) -> list[str]:
    path = folder / "tracker.py"
    path.write_text(PROGRAM.format(count=count, code=code))
    return [sys.executable, str(path)]


def test_a_programs_poses_its_garbage_and_its_end(tmp_path: Path) -> None:
    source = LinePoses(ProgramLines(program(tmp_path)))
    poses = []

    def ended() -> bool:
        poses.extend(source.poll())
        return source.ended

    eventually(ended)
    source.close()
    source.close()
    assert len(poses) + source.late == 100 and source.unreadable == 10
    assert all(pose.validity is Validity.TRACKED for pose in poses)
    times, now_ns = [pose.t_master_ns for pose in poses], time.monotonic_ns()
    assert times == sorted(set(times)) and times[-1] <= now_ns
    assert "code 3" in source.notice and "the base station is gone" in source.notice
    assert "10 lines are no poses" in source.notice and source.notice.isprintable()
    assert source.poll() == []


def test_closing_ends_a_program_that_goes_on(tmp_path: Path) -> None:
    lines = ProgramLines(program(tmp_path, count=100_000))
    eventually(lambda: lines.read())
    pid = lines._process.pid
    lines.close()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
    assert lines.end


def test_sockets_bring_lines_too() -> None:
    udp = UdpLines("127.0.0.1", 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(LINE, ("127.0.0.1", udp.port))
        sender.sendto(LINE.replace(b"1.5", b"1.6") + b"\n", ("127.0.0.1", udp.port))
        source, poses = LinePoses(udp), []
        eventually(lambda: poses.extend(source.poll()) or len(poses) == 2)
    with pytest.raises(SourceError, match="another port"):
        UdpLines("127.0.0.1", udp.port)
    source.close()
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        source = LinePoses(TcpLines("127.0.0.1", port))
        peer, _ = server.accept()
        peer.sendall(LINE + b"\n")
        poses = []
        eventually(lambda: poses.extend(source.poll()) or poses)
        peer.close()
        eventually(lambda: source.poll() == [] and source.ended)
        assert "closed" in source.notice
        source.close()
    with pytest.raises(SourceError, match="nobody answers"):
        TcpLines("127.0.0.1", port)


@pytest.mark.parametrize(("name", "says"), [
    ("run:", "is missing"), ("run:'", "no command line"), ("run:no-such-program-here", "no program"),
    ("tcp:host", "no address"), ("udp:99999", "no address")])
def test_a_source_that_cannot_be_opened_says_why(name: str, says: str) -> None:
    with pytest.raises(SourceError, match=says):
        open_source(name)


def test_a_file_has_no_trackers_to_choose_from() -> None:
    with pytest.raises(SourceError, match="Leave --tracker out"):
        open_source("recording.csv", "LHR-1A2B3C4D")


def rhot(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-m", "rhot_app", "poses", *arguments], capture_output=True, text=True)


def test_the_command_says_figures_and_records(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                              capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "poses.csv"
    done = rhot("--source", f"run:{' '.join(program(tmp_path))}", "--seconds", "60", "--out", str(out), "--json")
    assert done.returncode == 0, done.stderr
    fields = json.loads(done.stdout)
    assert "10 lines are no poses" in fields["notice"]
    stream = read_pose_stream(out)
    assert len(stream.t_ns) == fields["tracked"] > 30
    assert fields["rate_hz"] == pytest.approx(1e9 / np.diff(stream.t_ns).mean())
    speeds = np.diff(stream.poses[:, 0, 3]) / np.diff(stream.t_ns)
    assert np.median(speeds) == pytest.approx(1e-10, rel=0.01)
    announced: list[str] = []
    monkeypatch.setattr(compiled, "announce_compilation", announced.append)
    assert main(["poses", "--source", str(out)]) == 0 and len(announced) == 1
    said = capsys.readouterr().out
    assert "Hz" in said and "rejected" in said


@pytest.mark.parametrize(("arguments", "says"), [
    (("--source", "nothing.csv"), "no such file"), (("--source", "libsurvive"), "survive-cli"),
    (("--source", "run:true", "--seconds", "5"), "has ended with code 0"), (("--source", "openvr"), "nstall"),
    (("--source", "udp:1", "--seconds", "0"), "--seconds"), (("--source", "x", "--out", "/no/where.csv"), "no folder")])
def test_the_command_ends_with_code_2_and_a_sentence(arguments: tuple[str, ...], says: str) -> None:
    done = rhot(*arguments)
    assert done.returncode == 2 and says in done.stderr and "Traceback" not in done.stderr
