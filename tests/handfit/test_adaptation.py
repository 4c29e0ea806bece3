"""A hand file that is adapted to a tracked bare hand: key frames, what they determine, and what becomes of it."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import msgspec
import numpy as np
import pytest
from bare_scenes import DISTANCE_M, rig_of
from pictures import picture, taken, two_cameras, wall
from shipped_rig import RIGHT_HAND, RIGHT_MODEL

from rhot_app.barehand.key_frames import MAX_KEY_FRAMES, MIN_INTERVAL_S, SHAPE_SD, KeyFrame, KeyFrames, phalanx_sd
from rhot_app.barehand.surface import surface_of
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.calibration.verdict import Grade
from rhot_app.engine.rig_watch import JUDGE_NS, HandWatch
from rhot_app.estimation.layout import pose_matrix
from rhot_app.hand.anatomy import FingerAnatomy, HandAnatomy, load_hand, save_hand
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model
from rhot_app.hand.motion.hand_state import STATE
from rhot_app.hand.skeleton import HandPose
from rhot_app.handfit.adaptation import Adapted, adapt
from rhot_app.rig_history import accept_hand, require_hand_place, versions
from rhot_app.simulator.scene.motion_file import load_motion
from rhot_node.detect.foreground import learn_background, learn_skin, skin_foreground

POSES = 10
RIG_SEED = 4


def wrong(hand: HandAnatomy) -> HandAnatomy:
    """The hand with bones wrong by 5 % and radii by 8 %, each in its own direction."""
    rng, fingers = np.random.default_rng(RIG_SEED), {}
    for name, one in hand.fingers.items():
        bones = np.array(one.bones_mm) * (1.0 + 0.05 * rng.choice([-1.0, 1.0], 3))
        radii = np.array(one.radii_mm) * (1.0 + 0.08 * rng.choice([-1.0, 1.0], 3))
        fingers[name] = msgspec.structs.replace(one, bones_mm=tuple(bones.tolist()), radii_mm=tuple(radii.tolist()),
                                                marker_mm=min(one.marker_mm, float(bones[2])))
    return msgspec.structs.replace(hand, fingers=fingers)


@lru_cache
def tracked() -> tuple[HandAnatomy, KeyFrames, list[HandPose], BareHandTracker]:
    """The wrong hand file, the key frames of a spreading hand tracked with it, and the true poses."""
    truth, cameras = RIGHT_HAND, two_cameras(distance=DISTANCE_M)
    model = build_model(truth)
    surface, believed = surface_of(model), wrong(truth)
    walls = [wall(camera, 10 * k + 1, False) for k, camera in enumerate(cameras)]
    moving = load_motion("spread", model, np.array([0.0, 0.0, DISTANCE_M]), 1)
    poses = [moving.pose(0.37 * k) for k in range(POSES)]
    tracker, key_frames = None, None
    for k, pose in enumerate(poses):
        images = [picture(surface, pose.world_from_palm, pose.angles, camera, walls[c], k)
                  for c, camera in enumerate(cameras)]
        if tracker is None:
            known = [learn_skin(image, learn_background(skin_foreground(), [taken(empty, 90 + n) for n in range(3)]))
                     for image, empty in zip(images, walls, strict=True)]
            tracker = BareHandTracker(rig_of(cameras, believed), foreground=known, known_size=False)
            key_frames = KeyFrames(tracker.model)
        tracker.start(pose, 0)
        tracker.step(images, [0, 0])
        key_frames._last_s = -np.inf  # every picture is of another moment
        key_frames.offer(tracker)
    assert tracker is not None and key_frames is not None
    return believed, key_frames, poses, tracker


@lru_cache
def adapted() -> Adapted:
    """The hand by these key frames."""
    return adapt(tracked()[0], tracked()[1].kept)


def errors(hand: HandAnatomy, field: str) -> np.ndarray:
    """(15,) logarithms of the true values less the hand's."""
    truth = RIGHT_HAND
    return np.log([np.array(getattr(truth.fingers[name], field)) / np.array(getattr(hand.fingers[name], field))
                   for name in truth.fingers]).ravel()


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def test_a_wrong_hand_file_is_mended_by_ten_poses() -> None:
    believed, _, poses, _ = tracked()
    found = adapted()
    joints = []
    for state, pose in zip(found.states, poses, strict=True):
        world = pose_matrix(state)
        joints.append(forward(build_model(found.hand), HandPose(world, state[STATE.angles])).joints
                      - forward(RIGHT_MODEL, pose).joints)
    assert np.mean(np.linalg.norm(joints, axis=2)) < 1.0e-3
    assert rms(errors(found.hand, "radii_mm")) < 0.03 < rms(errors(believed, "radii_mm"))
    assert rms(errors(found.hand, "bones_mm")) < 0.045 < rms(errors(believed, "bones_mm"))
    # as certain as it says
    assert np.mean((errors(found.hand, "bones_mm") / found.length_sd) ** 2) < 3.0
    assert np.mean((errors(found.hand, "radii_mm") / found.radius_sd) ** 2) < 3.0
    thumb = found.hand.fingers["thumb"]
    assert thumb.bones_sd_mm is not None
    assert thumb.bones_sd_mm[1] == pytest.approx(found.length_sd[1] * thumb.bones_mm[1], rel=1e-3)


def test_key_frames_predict_how_certain_the_hand_will_be() -> None:
    _, key_frames, _, _ = tracked()
    predicted = phalanx_sd(key_frames.covariance)
    found = adapted()
    assert rms(predicted[0]) == pytest.approx(rms(found.length_sd), rel=0.3)
    assert rms(predicted[1]) == pytest.approx(rms(found.radius_sd), rel=0.3)
    assert key_frames.sufficient
    assert not KeyFrames(RIGHT_MODEL).sufficient


def test_what_tells_least_goes_first() -> None:
    _, key_frames, _, tracker = tracked()
    full = KeyFrames(tracker.model)
    nothing = KeyFrame(0.0, tracker.filter.newest.state, (), np.zeros((len(SHAPE_SD),) * 2))
    full.kept = [*key_frames.kept, *[nothing] * (MAX_KEY_FRAMES - POSES)]
    full.offer(tracker)
    assert len(full.kept) == MAX_KEY_FRAMES and sum(one is nothing for one in full.kept) == MAX_KEY_FRAMES - POSES - 1
    full.offer(tracker)  # the same moment again
    assert sum(one is nothing for one in full.kept) == MAX_KEY_FRAMES - POSES - 1 and MIN_INTERVAL_S > 0.0
    full.clear()
    assert not full.kept


def test_the_tracker_believes_the_stated_standard_deviations() -> None:
    _, _, _, tracker = tracked()
    found = adapted()
    rig = rig_of(tracker.cameras, found.hand)
    stated = np.sqrt(np.diagonal(BareHandTracker(rig).shape_covariance, axis1=1, axis2=2)).ravel()
    np.testing.assert_allclose(stated[3:18], found.length_sd, rtol=1e-2)
    np.testing.assert_allclose(stated[18:33], found.radius_sd, rtol=1e-2)


def altered(key_frames: Sequence[KeyFrame], px: float = 0.0, seen: bool = True) -> list[KeyFrame]:
    """The key frames with every edge moved along its slice, or with no edges."""
    out = []
    for one in key_frames:
        frames = [copy.copy(frame) for frame in one.frames]
        for frame in frames:
            assert frame.edges is not None
            frame.edges = frame.edges._replace(offset=frame.edges.offset + px, number=seen * frame.edges.number)
        out.append(replace(one, frames=tuple(frames)))
    return out


def test_pictures_that_were_kept_aside_confirm_the_hand() -> None:
    found = adapted()
    assert found.verdict.grade is Grade.GOOD and found.verdict.codes == {"adapted"}
    assert found.kept_aside[1] < found.kept_aside[0]


def test_a_hand_that_nothing_confirms_is_not_usable() -> None:
    believed, key_frames, _, _ = tracked()
    verdict = adapt(believed, altered(key_frames.kept, seen=False)).verdict
    assert not verdict.acceptable and verdict.codes >= {"hand_undetermined", "not_confirmed"}
    assert "not_confirmed" in adapt(believed, key_frames.kept[:1]).verdict.codes, "nothing was kept aside"
    two_hands = list(key_frames.kept)
    two_hands[::2], two_hands[1::2] = altered(two_hands[::2], 6.0), altered(two_hands[1::2], -3.0)
    verdict = adapt(believed, two_hands).verdict
    assert not verdict.acceptable and "not_confirmed" in verdict.codes
    found = adapted()
    verdict = replace(found, shape=found.shape + 5.0 * np.append(SHAPE_SD, np.zeros(15))).verdict
    assert not verdict.acceptable and "no_hand_has" in verdict.codes


def test_a_hand_file_keeps_what_it_was(tmp_path: Path) -> None:
    path, hand = tmp_path / "me.json", RIGHT_HAND
    thumb = msgspec.structs.replace(hand.fingers["thumb"], bones_sd_mm=(0.5, 0.4, 0.3), radii_sd_mm=(0.2, 0.2, 0.2))
    adapted = msgspec.structs.replace(hand, fingers={**hand.fingers, "thumb": thumb})
    save_hand(path, hand)
    assert "sd_mm" not in path.read_text(), "what is not known is left out, so that earlier programs read the file"
    require_hand_place(path)  # which lets a hand file be replaced
    kept = accept_hand(path, adapted, "hand adapted while it was tracked")
    assert load_hand(path) == adapted
    assert kept is not None and load_hand(kept.path) == hand
    assert [one.replaced_by for one in versions(path)] == ["hand adapted while it was tracked"]
    assert accept_hand(path, adapted, "again") is None
    assert isinstance(load_hand(path).fingers["index"], FingerAnatomy)


def test_the_engine_offers_the_hand_and_changes_nothing() -> None:
    believed, found, _, tracker = tracked()

    class Tracker:
        key_frames = found

    rig = rig_of(tracker.cameras, believed)
    watch = HandWatch(rig)
    assert [one.mender for one in watch.advice(Tracker(), JUDGE_NS)] == ["adapted"]  # type: ignore[arg-type]
    assert not watch.adapted(Tracker(), JUDGE_NS)["known"]  # type: ignore[arg-type]
    watch.wait()
    answer = watch.adapted(Tracker(), JUDGE_NS + 1)  # type: ignore[arg-type]
    assert answer["known"] and len(answer["rows"]) == 10 and "±" in answer["rows"][0][2]
    after = msgspec.convert(answer["document"], type(rig))
    assert rms(errors(after.hand, "radii_mm")) < 0.03
    assert rig.hand == believed
    again = HandWatch(after)
    assert not again.advice(Tracker(), JUDGE_NS)  # type: ignore[arg-type]
