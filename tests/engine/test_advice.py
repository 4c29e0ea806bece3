"""Sentences for the operator: there when something is wrong, naming where, and gone when it is mended."""

from dataclasses import replace

import msgspec
import pytest

from rhot_app.calibration.check.checks import check_rig
from rhot_app.engine.advice import (
    NodeFacts,
    calibration_advice,
    disk_advice,
    no_marker_advice,
    node_advice,
    one_camera_advice,
    times_advice,
)
from rhot_app.engine.node_meter import Recent
from rhot_app.engine.status import Advice, NodeStatus, most_urgent_first
from rhot_app.project import CameraCalibration, CameraPose, Intrinsics, Rig, load_rig, with_tracker
from rhot_node.files import resource_path

IDS = ("thumb", "index", "wrist")
STATUS = NodeStatus(1, "left", "streaming", False, 100.0, 1000, 0, {}, 1.0, 1e-4, 2e-4, paired=True)
WELL = NodeFacts(STATUS, Recent(200, 0, {}, 0), "10.0.0.5", 47800, (640, 480), None, 4 << 20, 4 << 20,
                 (0.0, 0.0, 0.0), False, 0.0)


def texts(facts: NodeFacts, running: bool = True) -> list[str]:
    return [advice.text for advice in node_advice(facts, IDS, running)]


def test_a_sentence_keeps_what_it_is_made_of_for_other_languages() -> None:
    """And survives the way to a client."""
    silent = replace(WELL, status=replace(STATUS, state="silent", paired=False))
    advice, = (one for one in node_advice(silent, IDS, running=True) if "does not answer" in one.text)
    again = msgspec.msgpack.decode(msgspec.msgpack.encode(advice), type=Advice)
    assert again.pattern.format(**again.values) == again.text == advice.text
    assert again.values["name"] == "left" and again.values["port"] == 47800


def test_a_well_node_needs_no_words() -> None:
    assert texts(WELL) == []
    assert no_marker_advice([WELL], running=True) == []


def test_a_black_picture_asks_for_no_colours() -> None:
    covered = replace(WELL, unseen_s=(5.0, 5.0, 5.0), black=True)
    assert no_marker_advice([covered, covered], running=True) == []
    assert texts(covered) == ["left is black: is the lens covered?"]


@pytest.mark.parametrize(("facts", "words"), [
    (replace(WELL, status=replace(STATUS, state="silent")), ["left", "10.0.0.5:47800", "rhot-node"]),
    (replace(WELL, status=replace(STATUS, state="silent", paired=False)), ["no key for it", "`rhot pair`"]),
    (replace(WELL, status=replace(STATUS, state="silent", turned_away=True)), ["does not know this computer", "pair"]),
    (replace(WELL, status=replace(STATUS, paired=False)), ["left is open", "untrusted"]),
    (replace(WELL, recent=Recent(100, 0, {"tag": 9}, 0)), ["not tagged with the key of node left"]),
    (replace(WELL, recent=Recent(100, 0, {"untagged": 9}, 0)), ["without a tag"]),
    (replace(WELL, status=replace(STATUS, state="fault", message="no camera: plug it in.")), ["no camera: plug it"]),
    (replace(WELL, status=replace(STATUS, state="ready"), not_started_s=2.0), ["press Stop and Start"]),
    (replace(WELL, streams_elsewhere=True), ["another master"]),
    (replace(WELL, recent=Recent(0, 0, {"marker_set": 50}, 0)), ["another marker set"]),
    (replace(WELL, recent=Recent(0, 0, {"image_size": 50}, 0), sent_size=(1280, 720)), ["1280 x 720", "640 x 480"]),
    (replace(WELL, recent=Recent(100, 0, {"magic": 40, "text": 10}, 0)), ["25 datagrams/s", "text_datagrams"]),
    (replace(WELL, recent=Recent(100, 50, {}, 0)), ["33 %", "lost"]),
    (replace(WELL, recent=Recent(9000, 0, {}, 500)), ["floods"]),
    (replace(WELL, status=replace(STATUS, clock_bound_s=0.004)), ["±4.0 ms"]),
    (replace(WELL, status=replace(STATUS, clock_bound_s=None)), ["waiting for its clock"]),
    (replace(WELL, status=replace(STATUS, text_datagrams=True)), ["untrusted"]),
    (replace(WELL, status=replace(STATUS, text_datagrams=True, state="ready")), ["text datagrams", "press Start"]),
    (replace(WELL, buffer_bytes=212992), ["208 KiB", "sysctl -w net.core.rmem_max=4194304"]),
    (replace(WELL, recent=Recent(100, 0, {"kernel_overflow": 9}, 0)), ["kernel drops"]),
    (replace(WELL, unseen_s=(0.0, 12.0, 0.0)), ["Camera left", "index", "12 s"]),
    (replace(WELL, unseen_s=(5.0, 12.0, 7.0)), ["seen no marker for 5 s"]),
    (replace(WELL, unseen_s=(5.0, 12.0, 7.0), black=True), ["left is black: is the lens covered?"]),
])
def test_trouble_is_named(facts: NodeFacts, words: list[str]) -> None:
    (text,) = texts(facts)
    for word in words:
        assert word in text


HERE = replace(WELL, address="127.0.0.1")


@pytest.mark.parametrize("facts", [
    replace(WELL, status=replace(STATUS, rate_hz=119.0), recent=Recent(238, 0, {}, 30)),
    replace(HERE, recent=Recent(100, 50, {}, 0)), replace(HERE, status=replace(STATUS, clock_bound_s=0.004)),
    replace(HERE, recent=Recent(100, 0, {"time": 40}, 0)),
])
def test_a_busy_computer_is_not_blamed_on_a_healthy_node(facts: NodeFacts) -> None:
    (text,) = texts(facts)
    assert "This computer is too busy" in text
    for blame in ("floods", "cable", "restart the node"):
        assert blame not in text


def test_what_arrived_and_was_refused_or_dropped_here_is_not_lost_on_the_way() -> None:
    (text,) = texts(replace(WELL, recent=Recent(100, 50, {"kernel_overflow": 50}, 0)))
    assert "kernel" in text
    assert texts(replace(WELL, recent=Recent(30, 4, {"clock_in_doubt": 170}, 0))) == []


def test_chance_is_not_trouble() -> None:
    assert texts(replace(WELL, recent=Recent(200, 3, {"magic": 2}, 0), unseen_s=(1.0, 0.0, 2.9))) == []


def test_idle_engines_do_not_miss_markers() -> None:
    assert texts(replace(WELL, unseen_s=(99.0, 99.0, 99.0)), running=False) == []


def test_one_sentence_when_nobody_sees_anything() -> None:
    blind = replace(WELL, unseen_s=(9.0, 8.0, 10.0))
    (advice,) = no_marker_advice([blind, blind], running=True)
    assert "No camera has seen a marker for 8 s" in advice.text
    assert node_advice(blind, IDS, True, visibility=False) == []
    assert no_marker_advice([blind, WELL], running=True) == []
    (advice,) = no_marker_advice([blind], running=True, painted=False)
    assert "landmarks install" in advice.text and "colours" not in advice.text, "of a rig of landmarks"


def test_what_must_be_done_now_comes_before_graver_words_about_less() -> None:
    blind = replace(WELL, unseen_s=(9.0, 8.0, 10.0))
    lossy = replace(WELL, recent=Recent(100, 40, {}, 0))
    gone = replace(WELL, status=replace(STATUS, state="silent"))
    stale = Advice("error", "The stereo calibration is stale.", "stereo", subject="calibration")
    said = [stale, *calibration_advice(load_rig(resource_path("rigs", "two_pis.json"))),
            *node_advice(lossy, IDS, True), *no_marker_advice([blind], running=True), *node_advice(gone, IDS, True),
            *disk_advice("/data", 300.0)]
    assert [one.subject for one in most_urgent_first(said)] == ["recording", "tracking", "sight", "equipment",
                                                               "calibration", "calibration"]
    assert most_urgent_first(said)[-2] is stale


def test_of_one_subject_errors_come_first_and_the_rest_stays_as_it_was() -> None:
    advice = [Advice("info", "a"), Advice("warning", "b"), Advice("error", "c"), Advice("warning", "d")]
    assert [one.text for one in most_urgent_first(advice)] == ["c", "b", "d", "a"]


def test_lenses_that_nobody_calibrated_are_said_once_and_as_rhot_check_says_it() -> None:
    rig = load_rig(resource_path("rigs", "two_pis.json"))
    (advice,) = calibration_advice(rig)
    assert advice.text.startswith("Not calibrated: millimetres are not reliable. The lenses of left and right")
    assert (advice.level, advice.mender, advice.lasting) == ("warning", "lens", True)
    assert [finding.sentence for finding in check_rig(rig).verdict.findings] == [advice.text]
    (advice,) = calibration_advice(with_tracker(rig, "estimator"))
    assert "estimator" in advice.text


def test_a_rig_known_exactly_and_one_that_was_calibrated_need_no_words() -> None:
    rig = load_rig(resource_path("rigs", "two_pis.json"))
    for calibration in (CameraCalibration("exact", error_m=0.0), CameraCalibration("board", "ruler", 5e-4)):
        lens = Intrinsics(640, 480, 533.0, 533.5, 320.1, 238.0, (-0.28, 0.09, 0.001, 0.0, 0.0))
        turned = CameraPose((0.99995, 0.01, 0.0, 0.0), (0.075, 0.0, 0.0))
        nodes = tuple(msgspec.structs.replace(node, intrinsics=lens) for node in rig.nodes)
        nodes = (nodes[0], msgspec.structs.replace(nodes[1], pose=turned))
        calibrated = msgspec.structs.replace(rig, nodes=nodes, calibration=calibration)
        assert calibration_advice(calibrated) == [] == list(check_rig(calibrated).verdict.findings)
    unproven = msgspec.structs.replace(calibrated, calibration=CameraCalibration("board", "skipped", 5e-4))
    (advice,) = calibration_advice(unproven)
    assert advice.text.startswith("Lengths were never checked against a ruler.") and advice.mender == "stereo"


@pytest.mark.parametrize(("seconds", "level", "words"), [(599.0, "warning", "in 9 minutes"),
                                                         (119.0, "warning", "in about a minute"),
                                                         (20.0, "error", "in less than a minute")])
def test_a_disk_that_will_be_full_is_told_in_minutes(seconds: float, level: str, words: str) -> None:
    (advice,) = disk_advice("/data/RHOT", seconds)
    assert advice.level == level and words in advice.text and "/data/RHOT" in advice.text
    assert disk_advice("/data/RHOT", 600.0) == disk_advice("/data/RHOT", float("inf")) == []


def test_what_one_camera_cannot_know_is_said() -> None:
    painted = load_rig(resource_path("rigs", "two_pis.json"))
    left, right = painted.nodes
    lone, = one_camera_advice(msgspec.structs.replace(painted, nodes=(left,)))
    assert "does not find a hand by painted markers" in lone.text
    rig = Rig("bare", painted.nodes)
    assert one_camera_advice(rig) == []
    alone, = one_camera_advice(msgspec.structs.replace(rig, nodes=(left,)))
    assert "left alone" in alone.text and "assumed lens (60" in alone.text and not alone.mender
    apart = msgspec.structs.replace(rig, nodes=(left, msgspec.structs.replace(right, pose_known=False)))
    advice, = one_camera_advice(apart)
    assert "until right is put together" in advice.text and advice.mender == "stereo"
    both = msgspec.structs.replace(apart, nodes=(*apart.nodes, msgspec.structs.replace(
        apart.nodes[1], name="top", node_id=7)))
    advice, = one_camera_advice(both)
    assert advice.values["names"] == "right, top", "a value has no words that nobody translates"
    calibrated = msgspec.structs.replace(left, intrinsics=Intrinsics(640, 480, 530.0, 530.0, 318.0, 240.0))
    known, = one_camera_advice(msgspec.structs.replace(rig, nodes=(calibrated,)))
    assert "the hand's size" in known.text and "assumed" not in known.text
    findings = check_rig(msgspec.structs.replace(apart, nodes=(calibrated, msgspec.structs.replace(
        apart.nodes[1], intrinsics=calibrated.intrinsics)))).verdict.findings
    codes = {finding.code for finding in findings}
    assert "unknown_poses" in codes and "coincident" not in codes


def test_times_that_nobody_compared_are_unknown_up_to_half_a_frame() -> None:
    rig = load_rig(resource_path("rigs", "two_pis.json"))
    lens = Intrinsics(640, 480, 533.0, 533.5, 320.1, 238.0)
    turned = CameraPose((0.99995, 0.01, 0.0, 0.0), (0.075, 0.0, 0.0))
    left, right = (msgspec.structs.replace(node, intrinsics=lens, address="127.0.0.1") for node in rig.nodes)
    right = msgspec.structs.replace(right, pose=turned)
    here = msgspec.structs.replace(rig, nodes=(left, right), calibration=CameraCalibration("board", "ruler", 5e-4))
    (advice,) = times_advice(here, [30.0, 15.0])
    assert "33 ms" in advice.text and (advice.mender, advice.level) == ("time", "info")
    (advice,) = times_advice(here, [0.0, 0.0])
    assert "half a frame" in advice.text and " ms" not in advice.text
    timed = msgspec.structs.replace(right, time_offset_sd_s=1e-4)
    assert times_advice(msgspec.structs.replace(here, nodes=(left, timed)), [30.0, 30.0]) == []
    for other in (rig, msgspec.structs.replace(here, calibration=CameraCalibration("exact", error_m=0.0)),
                  msgspec.structs.replace(here, calibration=None, nodes=rig.nodes),
                  msgspec.structs.replace(here, nodes=(left, msgspec.structs.replace(right, pose_known=False)))):
        assert times_advice(other, [30.0, 30.0]) == []
