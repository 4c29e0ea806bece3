"""What is wrong with a rig file is said without a picture; what is right is not blamed."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
import pytest

from rhot_app.__main__ import main
from rhot_app.calibration.check.camera_calibration import CalibrationAccuracy, calibration_error
from rhot_app.calibration.check.camera_calibration import with_lens as with_lens_of
from rhot_app.calibration.check.checks import check_rig
from rhot_app.calibration.verdict import Grade
from rhot_app.project import (
    CameraCalibration,
    CameraPose,
    Intrinsics,
    OneEuroSettings,
    Rig,
    RigNode,
    TrackerSettings,
    load_rig,
    save_rig,
    with_tracker,
)
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

LENS = Intrinsics(640, 480, 533.0, 533.5, 341.0, 235.0, (-0.28, 0.09, 0.001, 0.0, 0.0))


def change(struct: object, **fields: object) -> object:
    return msgspec.structs.replace(struct, **fields)  # type: ignore[type-var]


@pytest.fixture
def rig() -> Rig:
    """A rig as a calibration leaves it."""
    template = load_rig(resource_path("rigs", "two_pis.json"))
    calibrated = change(template, calibration=CameraCalibration("board", "ruler", 5e-4))
    return with_nodes(calibrated, lambda node: change(node, intrinsics=LENS))  # type: ignore[arg-type]


def with_nodes(rig: Rig, edit: Callable[[RigNode], object], only: str = "") -> Rig:
    nodes = tuple(edit(node) if only in ("", node.name) else node for node in rig.nodes)
    return change(rig, nodes=nodes)  # type: ignore[return-value]


def with_lens(rig: Rig, **fields: object) -> Rig:
    return with_nodes(rig, lambda node: change(node, intrinsics=change(node.intrinsics, **fields)), "left")


def with_right_at(rig: Rig, *place: float, turn: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)) -> Rig:
    return with_nodes(rig, lambda node: change(node, pose=CameraPose(turn, place)), "right")  # type: ignore[arg-type]


def test_a_calibrated_rig_is_good(rig: Rig) -> None:
    report = check_rig(rig)
    assert report.verdict.grade is Grade.GOOD
    assert not report.verdict.findings
    (pair,) = report.pairs
    assert pair.baseline_m == pytest.approx(0.075)
    assert 0.75 < pair.overlap[0] < pair.overlap[2] < 1.0


def test_a_rig_that_nobody_calibrated_is_not_called_good() -> None:
    report = check_rig(load_rig(resource_path("rigs", "two_pis.json")))
    assert report.verdict.codes == {"nominal"}
    assert report.verdict.grade is Grade.FAIR
    trusting = check_rig(with_tracker(load_rig(resource_path("rigs", "two_pis.json")), "estimator"))
    assert trusting.verdict.codes == {"nominal"} and "estimator" in trusting.verdict.findings[0].sentence


def test_cameras_that_nobody_put_together_are_not_called_good(rig: Rig) -> None:
    lenses_only = change(rig, calibration=None)
    assert check_rig(lenses_only).verdict.codes == {"nominal_poses"}  # type: ignore[arg-type]
    turned = with_right_at(lenses_only, 0.075, 0.0, 0.0, turn=(0.99995, 0.01, 0.0, 0.0))  # type: ignore[arg-type]
    assert not check_rig(turned).verdict.codes, "an older file that records nothing is not blamed"
    assert not calibration_error(turned).known and "does not say how well" in calibration_error(turned).reason


def test_a_lens_found_anew_makes_the_places_of_the_cameras_outdated(rig: Rig) -> None:
    after = with_lens_of(rig, "left", change(LENS, fx=540.0))  # type: ignore[arg-type]
    assert after.nodes[0].intrinsics.fx == 540.0 and after.nodes[1] == rig.nodes[1]
    assert check_rig(after).verdict.codes == {"outdated_poses"} and not calibration_error(after).known
    assert with_lens_of(change(rig, calibration=None), "left", LENS).calibration is None  # type: ignore[arg-type]


def test_lengths_that_nobody_checked_are_named(rig: Rig) -> None:
    skipped = change(rig, calibration=CameraCalibration("board", error_m=5e-4))
    verdict = check_rig(skipped).verdict  # type: ignore[arg-type]
    assert verdict.codes == {"lengths_unproven"} and verdict.grade is Grade.FAIR
    assert verdict.findings[0].figure == "Lengths were never checked against a ruler."


def test_the_error_by_the_calibration_grows_with_the_square_of_the_distance(rig: Rig) -> None:
    error = calibration_error(rig)
    places = np.array([[0.0375, 0.0, 0.6], [0.0375, 0.0, 1.2], [np.nan, 0.0, 0.6]])
    aside = 0.0375**2  # the cameras' places vary
    assert error.at(places)[:2] == pytest.approx([5e-4, 5e-4 * (1.2**2 + aside) / (0.6**2 + aside)])
    assert np.isnan(error.at(places)[2])
    exact = change(rig, calibration=CameraCalibration("exact"))
    assert calibration_error(exact).at(places)[0] == 0.0  # type: ignore[arg-type]
    unknown = calibration_error(load_rig(resource_path("rigs", "two_pis.json")))
    assert not unknown.known and np.isnan(unknown.at(places)).all()


RING = CalibrationAccuracy(2e-3, 0.6, 0.6 * np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0],
                                                      [0.0, -1.0, 0.0]]))


def test_in_a_ring_of_cameras_places_have_the_error_at_their_distance_from_them() -> None:
    covariance = RING.covariances(np.zeros(3))
    assert np.sqrt(np.trace(covariance)) > 1e-3 and covariance[0, 0] == pytest.approx(covariance[1, 1])


def test_the_error_lies_along_the_lines_of_sight(rig: Rig) -> None:
    """Two cameras side by side show a distance worst, and an error of several standard deviations has to be held."""
    sds = np.sqrt(np.diagonal(calibration_error(rig).covariances(np.array([0.0375, 0.0, 0.6]))))
    assert sds[2] == pytest.approx(5e-4, rel=0.01) and sds[2] > 1.5 * sds[0]


@pytest.mark.parametrize(("turn", "expected_mm"), [(1e-3, 1.2), (1e-4, 0.12)])
def test_a_camera_beside_another_does_not_make_places_uncertain(turn: float, expected_mm: float) -> None:
    centres = np.array([[0.0, 0.0, 0.0], [0.002, 0.0, 0.0], [0.3, 0.0, 0.0]])
    turns = np.array([0.0, turn, turn])
    both = CalibrationAccuracy(0.0, 0.6, centres).with_turns(turns, 0).turned_m
    assert 1e3 * both == pytest.approx(expected_mm * np.sqrt(2.0), rel=0.01)
    assert CalibrationAccuracy(0.0, 0.6, centres).with_turns(np.array([0.0, 0.0, turn]), 0).turned_m < both


def test_cameras_far_apart_are_not_taken_to_be_turned_further() -> None:
    assert RING.turn(np.array([1.2]))[0] == pytest.approx(2e-3 / 0.6)


@pytest.mark.parametrize("base_m", [0.075, 0.5, 1.2])
def test_a_turn_makes_the_error_that_it_comes_from(base_m: float) -> None:
    accuracy = CalibrationAccuracy(2e-3, 0.6, np.array([[0.0, 0.0, 0.0], [base_m, 0.0, 0.0]]))
    turns = np.array([0.0, *accuracy.turn(np.array([base_m]))])
    assert accuracy.with_turns(turns, 0).turned_m == pytest.approx(2e-3)



LENSES: list[tuple[str, Grade, dict[str, object]]] = [
    ("field_of_view", Grade.POOR, {"fx": 3.6, "fy": 3.6}),  # millimetres
    ("field_of_view", Grade.FAIR, {"fx": 1600.0, "fy": 1600.0}),
    ("principal_point", Grade.POOR, {"cx": 900.0}),
    ("principal_point", Grade.FAIR, {"cy": 350.0}),
    ("aspect", Grade.FAIR, {"fy": 400.0}),
    ("distortion", Grade.POOR, {"distortion": (-0.9, 0.0, 0.0, 0.0, 0.0)}),
]


@pytest.mark.parametrize(("code", "grade", "fields"), LENSES)
def test_a_lens_that_cannot_be_is_named(rig: Rig, code: str, grade: Grade, fields: dict[str, object]) -> None:
    found = {finding.code: finding for finding in check_rig(with_lens(rig, **fields)).verdict.findings}
    assert found[code].grade is grade
    assert "left" in found[code].figure.lower()


def test_cameras_that_cannot_work_together_are_named(rig: Rig) -> None:
    assert "coincident" in check_rig(with_right_at(rig, 0.001, 0.0, 0.0)).verdict.codes
    assert "narrow" in check_rig(with_right_at(rig, 0.01, 0.0, 0.0)).verdict.codes
    assert "apart" in check_rig(with_right_at(rig, 75.0, 0.0, 0.0)).verdict.codes
    assert "swapped" in check_rig(with_right_at(rig, -0.075, 0.0, 0.0)).verdict.codes
    away = check_rig(with_right_at(rig, 0.075, 0.0, 0.0, turn=(0.0, 0.0, 1.0, 0.0))).verdict
    assert "overlap" in away.codes
    assert not away.acceptable


def test_cameras_of_other_names_may_stand_in_any_order(rig: Rig) -> None:
    moved = with_right_at(rig, -0.075, 0.0, 0.0)
    renamed = with_nodes(moved, lambda node: change(node, name=f"pi {node.node_id}"))
    assert check_rig(renamed).verdict.grade is Grade.GOOD


def test_cameras_on_opposite_sides_of_the_hand_may_track(rig: Rig) -> None:
    opposite = check_rig(with_right_at(rig, 0.0, 0.0, 1.2, turn=(0.0, 0.0, 1.0, 0.0)))
    assert opposite.pairs[0].overlap[1] > 0.85
    assert "overlap" not in opposite.verdict.codes


def test_markers_hand_filters_and_ports_are_looked_at(rig: Rig) -> None:
    index = rig.markers.markers[1]
    twin = change(rig.markers.markers[2], chroma=index.chroma)
    markers = change(rig.markers, markers=(*rig.markers.markers[:2], twin, *rig.markers.markers[3:]))
    assert "colours" in check_rig(change(rig, markers=markers)).verdict.codes  # type: ignore[arg-type]
    landmarks = load_markers(resource_path("markers", "landmarks21.json"))  # their colours are for the screen
    assert "colours" not in check_rig(change(rig, markers=landmarks)).verdict.codes  # type: ignore[arg-type]
    thumb = change(rig.hand.fingers["thumb"], bones_mm=(4.6, 3.2, 2.7), marker_mm=1.0)  # centimetres
    hand = check_rig(change(rig, hand=change(rig.hand, fingers={**rig.hand.fingers, "thumb": thumb})))  # type: ignore[arg-type]
    assert not hand.verdict.acceptable
    assert "hand" in hand.verdict.codes
    slow = change(rig.filters, position=OneEuroSettings(min_cutoff_hz=0.01, beta=0.0))
    assert "filter" in check_rig(change(rig, filters=slow)).verdict.codes  # type: ignore[arg-type]
    together = with_nodes(rig, lambda node: change(node, address="10.0.0.1"))
    assert not check_rig(together).verdict.acceptable
    late = with_nodes(rig, lambda node: change(node, time_offset_s=0.4), "left")
    assert "time" in check_rig(late).verdict.codes


def test_a_rig_that_measures_disparity_needs_no_lenses(rig: Rig) -> None:
    blind = with_lens(change(rig, depth=change(rig.depth, mode="disparity")), fx=3.6)  # type: ignore[arg-type]
    assert check_rig(blind).verdict.codes == {"disparity"}


@pytest.mark.parametrize("kind", ["classic", "estimator"])
def test_nodes_that_the_chosen_tracker_cannot_use_are_named(rig: Rig, kind: Literal["classic", "estimator"]) -> None:
    left = msgspec.structs.replace(rig.nodes[0], text_datagrams=True, data_port=5005)
    verdict = check_rig(msgspec.structs.replace(rig, nodes=(left, rig.nodes[1]),
                                                tracker=TrackerSettings(kind=kind))).verdict
    found = [finding.sentence for finding in verdict.findings if finding.code == "tracker"]
    assert verdict.acceptable == (kind == "classic") and len(found) == (kind == "estimator")
    assert all(f"node {left.name} sends text" in sentence and "tracker.kind" in sentence for sentence in found)


def test_a_marker_that_the_estimator_cannot_place_is_named(rig: Rig) -> None:
    first, *others = rig.markers.markers
    markers = change(rig.markers, markers=(change(first, role=None), *others))
    for kind, named in (("classic", False), ("estimator", True)):
        verdict = check_rig(change(rig, markers=markers, tracker=TrackerSettings(kind=kind))).verdict  # type: ignore[arg-type]
        found = [finding.sentence for finding in verdict.findings if finding.code == "tracker"]
        assert verdict.acceptable != named and [first.id in sentence for sentence in found] == [True] * named


def test_text_datagrams_need_a_port_that_their_sender_knows(rig: Rig) -> None:
    text = with_nodes(rig, lambda node: change(node, text_datagrams=True), "left")
    found = [finding for finding in check_rig(text).verdict.findings if finding.code == "ports"]
    assert len(found) == 1 and found[0].sentence.startswith("left sends text datagrams, and its data_port is 0.")
    known = with_nodes(rig, lambda node: change(node, text_datagrams=True, data_port=5005), "left")
    assert "ports" not in check_rig(known).verdict.codes


def test_the_command_says_it_and_ends_with_code_2(rig: Rig, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "rig.json"
    save_rig(path, rig)
    assert main(["check", "--rig", str(path), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["grade"] == "good"
    assert told["pairs"][0]["baseline_mm"] == 75.0
    assert told["calibration"] == "with a board, ± 0.50 mm at 0.6 m; lengths checked by a ruler"
    save_rig(path, with_right_at(rig, -0.075, 0.0, 0.0))
    assert main(["check", "--rig", str(path)]) == 2
    assert "calibrated from mirrored pictures" in capsys.readouterr().out


def test_a_rig_with_what_only_pythons_json_takes_for_a_number_is_refused(rig: Rig, tmp_path: Path,
                                                                        capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "rig.json"
    save_rig(path, rig)
    document = json.loads(path.read_text())
    document["nodes"][0]["intrinsics"]["fx"] = float("nan")
    path.write_text(json.dumps(document))
    assert main(["check", "--rig", str(path)]) == 2
    assert f"{path}: not valid JSON" in capsys.readouterr().err


@pytest.mark.parametrize(("place", "value"), [
    ("nodes.0.address", "192.168.1.2\0"), ("nodes.0.address", "192.168.1.2\n"), ("nodes.0.address", ""),
    ("nodes.0.address", "pi left"), ("nodes.0.address", "x" * 300), ("broadcast.address", "255.255.255.255\n"),
    ("nodes.0.name", "left\x1b[2J"), ("nodes.0.name", "left\n"), ("name", "\u202etfel"),
    ("nodes.0.public_key", "0" * 64 + "\n"), ("nodes.0.intrinsics.fx", 1e300), ("nodes.0.intrinsics.cx", -1e300),
    ("nodes.0.pose.translation_m", [1e300, 0, 0]), ("nodes.0.time_offset_s", 1e12),
    ("filters.pixel.min_cutoff_hz", 1e300), ("depth.baseline_m", 1e300), ("hand.fingers.thumb.base_mm", [1e300, 0, 0]),
])
def test_check_and_engine_refuse_what_cannot_be_with_one_sentence(
        rig: Rig, tmp_path: Path, capsys: pytest.CaptureFixture[str], place: str, value: object) -> None:
    path = tmp_path / "rig.json"
    document = msgspec.to_builtins(rig)
    *way, field = place.split(".")
    there = document
    for step in way:
        there = there[int(step)] if step.isdecimal() else there[step]
    there[field] = value
    path.write_text(json.dumps(document))
    said = []
    for command in (["check", str(path)], ["engine", "--rig", str(path), "--directory", str(tmp_path / "e")]):
        assert main(command) == 2
        said.append(capsys.readouterr().err)
    assert said[0] == said[1]
    assert field in said[0]
    assert said[0].rstrip("\n").isprintable()


def test_the_engine_refuses_what_check_refuses(rig: Rig, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "rig.json"
    save_rig(path, with_right_at(rig, -0.075, 0.0, 0.0))
    assert main(["check", "--rig", str(path)]) == 2
    capsys.readouterr()
    assert main(["engine", "--rig", str(path), "--directory", str(tmp_path / "e")]) == 2
    said = capsys.readouterr().err
    assert "Right stands 75 mm to the left of left." in said
    assert "--unchecked" in said
    assert not (tmp_path / "e").exists()
