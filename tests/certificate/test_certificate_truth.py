"""The certificate of the simulated rig agrees with what is true of it, and says what is wrong with a wrong rig."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import msgspec
import numpy as np
import pytest
from fault_injection import changed
from scipy import stats
from simulated_protocol import SHORT, Recorded, recorded, with_baseline, with_focal_length

from rhot_app.certificate.certify import certify
from rhot_app.certificate.document import Certificate
from rhot_app.certificate.intervals import Interval
from rhot_app.certificate.latency import flash_edges, judge_latency, judge_timing
from rhot_app.certificate.lengths import DistanceReading, judge_depth, judge_rod
from rhot_app.certificate.recordings import FlashStep, Latencies, ProtocolFile, StaticStep, read_recording
from rhot_app.certificate.static import judge_handedness, judge_static, judge_upright
from rhot_app.recording.raw_log import LogReader
from rhot_app.simulator.film.node_log import write_node_log
from rhot_app.state import LATENCY_STAGES

Run = tuple[Recorded, Certificate]

RUNS = [2, pytest.param(8, marks=pytest.mark.study("rhot_app/certificate", "rhot_app/simulator/film"))]
NETWORK_MS = 0.120 + 0.060 * np.log(2.0)
"""The median way of a datagram on the simulated cable."""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Callable[[int], Run]:
    """Rigs by seed, each recorded and certified once."""
    folder = tmp_path_factory.mktemp("protocols")

    @cache
    def made(seed: int) -> Run:
        one = recorded(folder / str(seed), seed)
        return one, certify(one.folder, one.protocol, one.rig)
    return made


@pytest.fixture
def one(run: Callable[[int], Run]) -> Recorded:
    return run(1)[0]


def true_delay_ms(one: Recorded) -> float:
    """From the screen's order to the arrival at the master: its own delay, then from exposure to arrival."""
    assert one.protocol.flash is not None
    recording = read_recording(one.folder / one.protocol.flash.log, one.rig)
    marker = recording.marker(one.protocol.flash.marker)
    lit = np.isfinite(recording.pixels[:, marker, 0])
    ages = [np.mean((recording.arrivals_ns - recording.exposed_ns[:, marker])[lit & (recording.cameras == camera)])
            for camera in range(recording.camera_count)]
    return 1e3 * SHORT.screen_s + 1e-6 * float(np.mean(ages))


def missed(one: Recorded, certificate: Certificate) -> Iterator[tuple[str, str]]:
    """(what, "" or how its interval misses the truth) of a run."""
    wanted = [("depth", "scale error", 0.0), ("depth", "zero", 0.0), ("depth", "exponent z of eq. 7.4", -1.0),
              ("rod", "length error", 0.0), ("rod", "length error across the view", 0.0),
              ("rod", "length error along the view", 0.0), ("upright", "to the right", 0.0), ("upright", "away", 0.0),
              ("latency", "screen to the picture's timestamp", 1e3 * SHORT.screen_s),
              ("latency", "screen to master", true_delay_ms(one)), ("timing", "network, p50", NETWORK_MS)]
    for code, name, truth in wanted:
        found = certificate.line(code).figure(name)
        assert found is not None, f"{code} has no {name}"
        said = f"{found.value} ({found.low} to {found.high}), not {truth:.4g}"
        yield name, "" if found.interval.holds(truth) else said


@pytest.mark.parametrize("count", RUNS)
def test_intervals_hold_what_is_true_of_the_twin(run: Callable[[int], Run], count: int) -> None:
    found = [each for seed in range(count) for each in missed(*run(1 + seed))]
    for name in {name for name, _ in found}:
        of_one = [how for what, how in found if what == name and how]
        assert len(of_one) <= stats.binom.ppf(0.99, count, 0.05), f"{name}: {of_one}"
    of_all = [(name, how) for name, how in found if how]
    assert len(of_all) <= stats.binom.ppf(0.999, len(found), 0.05), of_all


@pytest.mark.parametrize("count", RUNS)
def test_a_perfect_rig_agrees_in_nearly_every_line(run: Callable[[int], Run], count: int) -> None:
    lines = [line for seed in range(count) for line in run(1 + seed)[1].lines
             if line.code != "timing"]  # of any computer
    assert all(line.verdict != "not measured" for line in lines)
    differing = [f"{line.title}: {line.sentence}" for line in lines if line.verdict == "differs"]
    assert len(differing) <= stats.binom.ppf(0.999, 2 * count, 0.05), "\n".join(differing)


@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_a_wrong_baseline_is_named(run: Callable[[int], Run], factor: float) -> None:
    said = []
    for seed in (1, 2):
        one = run(seed)[0]
        certificate = certify(one.folder, ProtocolFile(ruler=one.protocol.ruler, rod=one.protocol.rod),
                              with_baseline(one.rig, factor))
        for code in ("depth", "rod"):
            line = certificate.line(code)
            said.append(line.verdict == "differs" and "baseline" in line.cause
                        and ("too long" if factor > 1.0 else "too short") in line.cause)
            error = line.figure("scale error" if code == "depth" else "length error")
            assert error is not None and error.interval.widened(0.1).holds(100.0 * (factor - 1.0))
    assert sum(said) >= len(said) - 1, said


def test_a_wrong_focal_length_is_told_from_a_wrong_baseline(one: Recorded) -> None:
    line = certify(one.folder, ProtocolFile(rod=one.protocol.rod), with_focal_length(one.rig, 1.03)).line("rod")
    assert line.verdict == "differs" and "focal length" in line.cause


def test_a_mirrored_rig_is_found_out(run: Callable[[int], Run]) -> None:
    """The hand that was shown was the other one than stated: so looks a rig whose pictures are mirrored."""
    one, certificate = run(1)
    assert certificate.line("handedness").verdict == "agrees"
    other = msgspec.structs.replace(one.rig, hand=msgspec.structs.replace(one.rig.hand, side="left"))
    line = certify(one.folder, ProtocolFile(static=one.protocol.static), other).line("handedness")
    assert line.verdict == "differs" and "mirror" in line.sentence


def test_pictures_that_are_mirrored_are_found_out(one: Recorded, tmp_path: Path) -> None:
    """Both cameras mirror, and a calibration with such pictures exchanged them: residuals are as small as before."""
    assert one.protocol.static is not None
    reader = LogReader(one.folder / one.protocol.static.log)
    width = one.rig.nodes[0].intrinsics.width
    flipped = changed(list(reader), lambda _t, _node, seen: [
        msgspec.structs.replace(mark, x=width - 1 - mark.x) for mark in seen])
    reader.close()
    left, right = one.rig.nodes
    nodes = (msgspec.structs.replace(left, pose=right.pose), msgspec.structs.replace(right, pose=left.pose))
    mirrored = msgspec.structs.replace(one.rig, nodes=nodes)
    write_node_log(tmp_path / "static.rhotlog", mirrored, {}, [record for record in flipped if record.node_id])
    certificate = certify(tmp_path, ProtocolFile(static=StaticStep("static.rhotlog", "palm")), mirrored)
    assert certificate.line("static").verdict == "agrees"
    assert certificate.line("handedness").verdict == "differs"


def test_a_tilted_rig_is_found_out(one: Recorded) -> None:
    line = certify(one.folder, ProtocolFile(plumb=one.protocol.plumb),
                   msgspec.structs.replace(one.rig, up="z")).line("upright")
    assert line.verdict == "differs" and line.figures[0].interval.widened(0.1).holds(90.0)


def test_steps_that_are_missing_are_not_measured(one: Recorded) -> None:
    certificate = certify(one.folder, ProtocolFile(), one.rig)
    assert {line.verdict for line in certificate.lines} == {"not measured"}
    assert all(line.remedy and line.sentence for line in certificate.lines)
    assert "7 not measured" in certificate.summary


def test_a_code_that_was_not_shown_measures_nothing(one: Recorded) -> None:
    flash = one.protocol.flash
    assert flash is not None
    other = tuple((flash.edges[0][0] + round(1e9 * t), lit) for t, lit in flash_edges(10.0, 999))
    line = certify(one.folder, ProtocolFile(flash=FlashStep(flash.log, flash.marker, other)), one.rig).line("latency")
    assert line.verdict == "not measured" and "code" in line.sentence


def test_timestamps_that_are_late_together_are_found_out(run: Callable[[int], Run]) -> None:
    """All nodes say the same wrong time: nothing between them disagrees, and the screen does."""
    one, certificate = run(1)
    late = msgspec.structs.replace(one.rig, nodes=tuple(
        msgspec.structs.replace(node, time_offset_s=-0.03) for node in one.rig.nodes))
    line = certify(one.folder, ProtocolFile(flash=one.protocol.flash), late).line("latency")
    assert line.verdict == "differs" and "before the light" in line.cause
    whole, before = line.figure("screen to master"), certificate.line("latency").figure("screen to master")
    assert whole is not None and before is not None and whole.value == pytest.approx(before.value, abs=0.5)


def test_what_would_not_show_is_not_said_to_agree(one: Recorded) -> None:
    """A rod as short as its reading is coarse, and too few states for a 99th percentile."""
    rod = one.protocol.rod
    assert rod is not None
    recording = read_recording(one.folder / rod.log, one.rig)
    tiny = replace(recording, positions=recording.positions.copy())
    first, second = (recording.marker(name) for name in rod.markers)
    tiny.positions[:, second] = tiny.positions[:, first] + 0.1 * (tiny.positions[:, second] - tiny.positions[:, first])
    line = judge_rod(tiny, rod.markers, 1e-4 * rod.length_mm, one.rig)
    assert line.verdict == "not measured" and "would not show" in line.sentence and line.figures
    times = np.random.default_rng(1).exponential(1e-3, (100, len(LATENCY_STAGES)))
    assert judge_timing(times).verdict == "not measured"
    assert judge_timing(np.tile(times, (40, 1))).verdict == "agrees"
    assert judge_timing(times + 0.02).verdict == "differs"


def test_an_unknown_clock_proves_no_time(one: Recorded) -> None:
    flash = one.protocol.flash
    assert flash is not None
    recording = read_recording(one.folder / flash.log, one.rig)
    latencies = Latencies(np.full((20, len(LATENCY_STAGES)), 1e-3), np.full(20, 0.01))
    assert judge_latency(recording, flash.marker, flash.edges, latencies).verdict == "agrees"
    vague = replace(recording, clock_bound_s=0.5)
    line = judge_latency(vague, flash.marker, flash.edges, latencies)
    assert line.verdict == "not measured" and "would not show" in line.sentence


def test_distances_that_show_nothing_do_not_agree(one: Recorded) -> None:
    near = [DistanceReading(ruler_m, Interval(ruler_m, ruler_m - 0.05, ruler_m + 0.05), np.full(20, 60.0))
            for ruler_m in (0.4, 0.45, 0.5, 0.55)]
    line = judge_depth(near, one.rig)
    assert line.verdict == "not measured" and "would not show" in line.sentence
    same = judge_depth([near[0]] * 4, one.rig)
    assert same.verdict == "not measured" and judge_depth(near[:3], one.rig).verdict == "not measured"


def test_a_rod_that_is_upside_down_or_too_short_proves_nothing_upright(one: Recorded) -> None:
    plumb = one.protocol.plumb
    assert plumb is not None
    recording = read_recording(one.folder / plumb.log, one.rig)
    assert judge_upright(recording, plumb.upper, plumb.lower, one.rig).verdict == "agrees"
    turned = judge_upright(recording, plumb.lower, plumb.upper, one.rig)
    assert turned.verdict == "differs" and "upside down" in turned.cause
    upper, lower = (recording.marker(name) for name in (plumb.upper, plumb.lower))
    places = recording.positions.copy()
    places[:, upper] = places[:, lower] + 0.05 * (places[:, upper] - places[:, lower])
    short = judge_upright(replace(recording, positions=places), plumb.upper, plumb.lower, one.rig)
    assert short.verdict == "not measured"


def test_a_hand_edge_on_shows_no_side(one: Recorded) -> None:
    static = one.protocol.static
    assert static is not None
    recording = read_recording(one.folder / static.log, one.rig)
    roles = [marker.role for marker in one.rig.markers.markers]
    wrist, index, little = (roles.index(role) for role in ("wrist", "index_tip", "little_tip"))
    places = recording.positions.copy()
    noise = np.random.default_rng(1).normal(0.0, 1e-3, (len(places), 3))
    places[:, little] = 0.5 * (places[:, wrist] + places[:, index]) + noise
    assert judge_handedness(replace(recording, positions=places), static.facing, one.rig).verdict == "not measured"


def test_jitter_that_is_hardly_known_does_not_agree(one: Recorded) -> None:
    assert one.protocol.static is not None
    recording = read_recording(one.folder / one.protocol.static.log, one.rig)
    noise = np.random.default_rng(1).normal(0.0, 4.5, recording.pixels.shape)
    few = replace(recording, pixels=recording.pixels + noise)
    kept = np.arange(len(recording.cameras)) < 24
    for name in ("pixels", "cameras"):
        few = replace(few, **{name: getattr(few, name)[kept]})
    assert judge_static(few, one.rig).verdict == "not measured"


def test_jitter_beyond_the_thesis_differs(one: Recorded) -> None:
    assert one.protocol.static is not None
    recording = read_recording(one.folder / one.protocol.static.log, one.rig)
    noisy = recording.pixels + np.random.default_rng(1).normal(0.0, 7.0, recording.pixels.shape)
    assert judge_static(recording, one.rig).verdict == "agrees"
    line = judge_static(replace(recording, pixels=noisy), one.rig)
    assert line.verdict == "differs" and line.figures[0].interval.widened(0.2).holds(7.0)


def test_edges_are_irregular_and_a_seed_gives_them_again() -> None:
    edges = flash_edges(20.0, 3)
    assert edges == flash_edges(20.0, 3) != flash_edges(20.0, 4)
    assert len(edges) > 40 and [lit for _, lit in edges[:2]] == [True, False]
    assert np.ptp(np.diff([t for t, _ in edges])) > 0.2
