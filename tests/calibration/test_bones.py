"""Bones: what many and what six markers show, how exactly, lengths by a ruler, bad recordings, and the command."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest
from bones_twin import RICH, SIX, TRIAD, Sloppiness, base_hand, bones_mm, person, record

from rhot_app.__main__ import main
from rhot_app.calibration.hand import fit as hand_fit
from rhot_app.calibration.hand.bones import enter_bones, solve_bones
from rhot_app.calibration.hand.bones_judgement import drift_findings
from rhot_app.calibration.hand.bones_result import BonesResult, Known
from rhot_app.calibration.hand.marker_places import MarkerTracks, tracks_of
from rhot_app.errors import CalibrationError
from rhot_app.hand.anatomy import HandAnatomy, load_hand
from rhot_app.hand.skeleton import FINGERS
from rhot_app.recording.qualisys import read_qualisys

QUALISYS = Path(__file__).parents[3] / "shared" / "data" / "hand_motion" / "qualisys_hand_30s.tsv"
CAPTURED = Sloppiness(noise_m=0.1e-3)
"""As motion capture sees markers."""


def lengths_mm(report: BonesResult) -> np.ndarray:
    return np.array([bone.length_mm for bone in report.bones]).reshape(5, 3)


def left_out_of_right(tracks: MarkerTracks) -> MarkerTracks:
    return replace(tracks, positions=tracks.positions * [1.0, -1.0, 1.0])


def write_tsv(path: Path, tracks: MarkerTracks, names: list[str] | None = None) -> Path:
    """As Qualisys exports it."""
    names = names or [place.name for place in tracks.places]
    rows = [[str(k + 1), f"{t:.5f}", *("" if np.isnan(v) else f"{1e3 * v:.3f}" for v in at.ravel())]
            for k, (t, at) in enumerate(zip(tracks.times_s, tracks.positions, strict=True))]
    heads = [f"{name} {axis}" for name in names for axis in "XYZ"]
    path.write_text("\n".join("\t".join(row) for row in [["MARKER_NAMES", *names], ["Frame", "Time", *heads], *rows]))
    return path


@pytest.fixture(scope="module")
def hand() -> HandAnatomy:
    return person(2, side="left")


@pytest.fixture(scope="module")
def rich(hand: HandAnatomy) -> MarkerTracks:
    """A minute of a left hand with a marker on every bone."""
    return record(hand, RICH, 2, rate_hz=40.0, sloppiness=CAPTURED)


@pytest.fixture(scope="module", autouse=True)
def few_instants() -> Iterator[None]:
    """Solve from a part of the instants: less exact, and quick."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(hand_fit, "INSTANTS", 50)
        yield


@pytest.fixture(scope="module")
def rich_report(rich: MarkerTracks) -> BonesResult:
    return solve_bones(rich, base_hand("left"))


def test_a_marker_on_every_bone_shows_every_bone_of_a_left_hand(hand: HandAnatomy, rich_report: BonesResult) -> None:
    errors = lengths_mm(rich_report) - bones_mm(hand)
    assert np.abs(errors).max() < 2.0
    assert np.abs(errors[:, :2]).max() < 1.0
    assert rich_report.hand.side == "left" and rich_report.verdict.acceptable, rich_report.verdict
    inner = [bone for k, bone in enumerate(rich_report.bones) if k % 3 == 0]
    assert all(bone.known is Known.OBSERVED for bone in inner)


def test_the_truth_lies_within_what_is_stated(hand: HandAnatomy, rich_report: BonesResult) -> None:
    stated = np.array([bone.std_mm for bone in rich_report.bones]).reshape(5, 3)
    off = np.abs(lengths_mm(rich_report) - bones_mm(hand)) / stated
    assert (off < 1.96).sum() >= 13 and off.max() < 3.5
    assert stated.max() < 2.2, "that it may be anything is no statement"
    spots = {spot.marker: spot for spot in rich_report.markers}
    assert len(rich_report.rigid) == 3 and spots["palm_1"].place == "palm"


def test_a_right_hand_is_not_taken_for_a_left_one(rich: MarkerTracks) -> None:
    short = left_out_of_right(rich).within(0.0, 25.0)
    report = solve_bones(short, base_hand("left"))
    assert "wrong_side" in report.verdict.codes and not report.verdict.acceptable
    assert "--side right" in report.verdict.findings[0].sentence


def test_two_halves_of_a_real_hand_agree() -> None:
    if not QUALISYS.exists():
        pytest.skip(f"{QUALISYS} is not there")
    points = read_qualisys(QUALISYS)
    tracks = tracks_of(points.times_s, points.positions, points.names)
    middle = 0.5 * tracks.duration_s
    first, second = (solve_bones(half, base_hand()) for half in (tracks.within(0.0, middle),
                                                                 tracks.within(middle, np.inf)))
    assert np.abs(lengths_mm(first) - lengths_mm(second)).max() < 1.0
    assert all(report.verdict.acceptable for report in (first, second))
    assert {round(pair.distance_mm) for pair in first.rigid} == {round(pair.distance_mm) for pair in second.rigid}


def test_six_markers_show_the_size_and_no_single_bone() -> None:
    hand = person(2)
    report = solve_bones(record(hand, SIX, 2, seconds=40.0, rate_hz=40.0, sloppiness=Sloppiness(noise_m=0.5e-3)),
                         base_hand())
    assert all(bone.known is Known.PRIOR for bone in report.bones)
    assert "not_observed" in report.verdict.codes and "single bones are not observed" in report.verdict.sentence
    reach = np.array([np.linalg.norm(hand.fingers[f].base_mm) + sum(hand.fingers[f].bones_mm) for f in FINGERS])
    usual = np.array([np.linalg.norm(base_hand().fingers[f].base_mm) + sum(base_hand().fingers[f].bones_mm)
                      for f in FINGERS])
    assert report.size == pytest.approx(np.mean(reach[1:] / usual[1:]), rel=0.02)
    assert 0.0 < report.size_std < 0.05


def test_a_hand_that_holds_still_is_told_to_move() -> None:
    moving = record(person(3), RICH, 3, seconds=30.0, rate_hz=20.0)
    rng = np.random.default_rng(1)
    still = replace(moving, positions=moving.positions[200] + rng.normal(0, 0.4e-3, moving.positions.shape))
    report = solve_bones(still, base_hand())
    told = [finding.sentence for finding in report.verdict.findings if finding.code == "finger_still"]
    assert len(told) == 5 and all("bend it further" in sentence for sentence in told)
    assert sum(bone.known is Known.PRIOR for bone in report.bones) >= 10


def test_a_few_seconds_are_too_short() -> None:
    report = solve_bones(record(person(3), SIX, 3, seconds=4.0, sloppiness=CAPTURED), base_hand())
    assert not report.verdict.acceptable and "too_short" in report.verdict.codes
    assert "4 s long" in report.verdict.findings[0].sentence and "minute" in report.verdict.findings[0].sentence
    with pytest.raises(CalibrationError, match="only 4 instants"):
        solve_bones(record(person(3), RICH, 3, seconds=0.07), base_hand())
    with pytest.raises(CalibrationError, match="the recording is empty"):
        solve_bones(record(person(3), RICH, 3, seconds=1.0).within(5.0, 6.0), base_hand())


def test_what_is_wrong_with_a_recording_is_named(rich_report: BonesResult) -> None:
    assert rich_report.verdict.codes <= {"not_observed"}
    somebody = record(person(3), RICH, 3, seconds=22.0, rate_hz=20.0, sloppiness=CAPTURED)
    at, half = somebody.positions, len(somebody.times_s) // 2
    apart = at[:, 0] - at[:, 1]
    slipped = at.copy()
    slipped[half:, 0] += 6e-3 * (apart / np.linalg.norm(apart, axis=1, keepdims=True))[half:]
    assert "marker_slipped" in solve_bones(replace(somebody, positions=slipped), base_hand()).verdict.codes
    noisy = at + np.random.default_rng(0).normal(0.0, 7e-3, at.shape)
    fingers = replace(somebody, positions=noisy[:, 3:], places=somebody.places[3:])
    assert {"large_error", "no_palm"} <= solve_bones(fingers, base_hand()).verdict.codes


def test_a_bone_that_no_hand_has_is_refused() -> None:
    hand = person(2)
    middle = hand.fingers["middle"]
    first, *others = middle.bones_mm
    longer = msgspec.structs.replace(middle, bones_mm=(1.6 * first, *others))
    unusual = msgspec.structs.replace(hand, fingers={**hand.fingers, "middle": longer})
    verdict = solve_bones(record(unusual, RICH, 2, seconds=22.0, rate_hz=20.0, sloppiness=CAPTURED),
                          base_hand()).verdict
    assert "unusual_bone" in verdict.codes and not verdict.acceptable
    assert "middle.proximal" in verdict.findings[0].figure


def test_a_marker_that_steps_on_its_bone_is_named() -> None:
    rng, times = np.random.default_rng(1), np.linspace(0.0, 30.0, 300)
    local = rng.normal(0.0, 0.2e-3, (300, len(RICH), 3))
    assert drift_findings(times, local, RICH, 0.1e-3) == []
    local[150:, 4, 0] += 3e-3
    (found,) = drift_findings(times, local, RICH, 0.1e-3)
    assert found.code == "marker_slipped" and RICH[4].name in found.figure


def test_markers_with_swapped_names_are_found_out() -> None:
    tracks = record(person(4), RICH, 4, seconds=30.0, rate_hz=20.0)
    order = list(range(len(RICH)))
    names = [place.name for place in RICH]
    for one, other in (("index_proximal", "little_proximal"), ("ring_proximal", "ring_medial")):
        a, b = names.index(one), names.index(other)
        order[a], order[b] = b, a
    report = solve_bones(replace(tracks, positions=tracks.positions[:, order]), base_hand())
    assert not report.verdict.acceptable
    told = {finding.code: finding.sentence for finding in report.verdict.findings}
    assert "index_proximal" in told["misplaced"] and "little_proximal" in told["misplaced"]
    assert "swapped with the next one on the finger" in told["beyond_bone"]
    assert any(f.code == "beyond_bone" and f.figure.startswith("ring_") for f in report.verdict.findings)


def test_lengths_by_a_ruler_stand_in_the_hand() -> None:
    report = enter_bones(base_hand(), {"index.proximal": 41.0})
    assert report.hand.fingers["index"].bones_mm[0] == pytest.approx(41.0, abs=0.01)
    assert report.verdict.acceptable
    with pytest.raises(CalibrationError):
        enter_bones(base_hand(), {"index.nose": 41.0})
    for length_mm, acceptable in ((4.1, False), (70.0, True)):
        verdict = enter_bones(base_hand(), {"index.proximal": length_mm}).verdict
        assert verdict.codes == {"implausible_bone"} and verdict.acceptable == acceptable


def test_the_command_says_what_it_took_each_marker_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    places = (*TRIAD[:1], *(place for place in SIX if not place.on_palm))
    tracks = record(person(5), places, 5, seconds=22.0, rate_hz=40.0, sloppiness=CAPTURED)
    names = ["m1", *(place.name for place in places[1:])]
    take = write_tsv(tmp_path / "take 3.tsv", tracks, names)
    out = tmp_path / "hand.json"
    command = ["calibrate", "bones", "--tsv", str(take), "--roles", "m1=palm_1", "--out", str(out)]
    assert main(command) == 0
    text = capsys.readouterr().out
    assert "guessed from the markers' names" in text and "index_tip = index distal" in text and "m1 =" not in text
    assert "not observed: what is usual" in text and f"Written: {out}" in text
    assert load_hand(out).name == "measured from take 3.tsv"
    assert main([*command, "--name", "Ada", "--side", "right", "--json"]) == 0
    fields = json.loads(capsys.readouterr().out)
    assert fields["places"]["m1"] == {"place": "palm", "guessed": False}
    assert fields["places"]["thumb_tip"] == {"place": "thumb distal", "guessed": True}
    assert fields["name"] == load_hand(out).name == "Ada" and len(fields["bones"]) == 15


def test_the_command_refuses_with_a_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = tmp_path / "notes.tsv"
    text.write_text("not a recording\n")
    out = tmp_path / "hand.json"
    for arguments, words in (
            (["--tsv", str(tmp_path / "none.tsv")], "no such file"), (["--tsv", str(text)], "not a Qualisys TSV"),
            (["--set", "index.proximal=long"], "not a number"), (["--set", "index.proximal"], "NAME=VALUE"),
            (["--set", "index.proximal=41", "index.proximal=42"], "twice"), ([], "give one of")):
        assert main(["calibrate", "bones", *arguments, "--out", str(out)]) == 2
        told = capsys.readouterr().err
        assert told.startswith("rhot: ") and words in told
    assert main(["calibrate", "bones", "--set", "index.proximal=41", "--out", str(tmp_path / "no" / "hand.json")]) == 2
    assert "there is no folder" in capsys.readouterr().err
    assert not out.exists() and not (tmp_path / "no").exists()
