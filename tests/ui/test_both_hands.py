"""Two hands in the window: both drawn, each by its own knowledge, and nothing left of a hand that is gone."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from fake_backend import FakeBackend
from fake_engine import FakeEngine
from landmark_detector import landmark_rig
from PySide6.QtCore import QPoint
from two_hands_engine import ASIDE, TwoHandsEngine, one_hand_rig, two_hand_rig

from rhot_app.engine import status
from rhot_app.project import TrackerSettings
from rhot_app.state import Condition, no_hand
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.models.words import hand_names
from rhot_app.ui.scene.ellipsoid_mesh import EllipsoidChoice
from rhot_app.ui.scene.frames import camera_like_state, to_display
from rhot_app.ui.scene.hands import hands_of
from rhot_app.ui.scene.view import SceneView

T_S = 3.0
SHADOW, SKELETON, MARKERS, SKIN, ELLIPSOIDS = range(5)


@pytest.fixture
def engine():
    return TwoHandsEngine(clock=lambda: 0.0)


@pytest.fixture
def state(engine):
    return engine.state(T_S)


@pytest.fixture
def scene(themed, qtbot):
    """A scene without a window, of a rig with two hands."""
    view = SceneView(DARK)
    qtbot.addWidget(view)
    view.resize(700, 500)
    view.show_rig(two_hand_rig())
    return view


def drawn(scene, hand, part):
    """(N, 3) m, scene frame: the vertices of one part of the first (0) or other (1) hand; none when it is hidden."""
    item = scene.actors.hands[hand].items[part]
    return item.vertices if item.visible() else np.empty((0, 3))


def extent(vertices):
    """m, along the axis in which it is longest; 0 for what is collapsed or hidden."""
    return float(np.ptp(vertices, axis=0).max()) if len(vertices) else 0.0


def looks(scene, hand, part):
    """(N, 4) colours of one part."""
    return scene.actors.hands[hand].items[part].colours


def test_each_hand_has_its_own_markers_and_none_has_them_twice():
    rig = two_hand_rig()
    right, left = hands_of(rig)
    assert [*left.columns, *right.columns] == list(range(12))
    assert [marker.role for marker in left.markers.markers] == [marker.role for marker in right.markers.markers]
    assert left.anatomy.side == "left" and left.markers.ids[0] == "left thumb"
    (alone,) = hands_of(one_hand_rig())
    assert alone.markers == one_hand_rig().markers and len(alone.columns) == 6


def test_both_hands_are_drawn_where_they_are(scene, state):
    scene.show_state(status.decode(status.TOPIC_STATE, status.encode(state)))  # as it comes from the engine
    for hand, one in enumerate((state, state.other)):
        joints = to_display(one.joint_positions)
        for part in (SKIN, SKELETON, ELLIPSOIDS):
            low, high = drawn(scene, hand, part).min(axis=0), drawn(scene, hand, part).max(axis=0)
            assert (low < joints.min(axis=0) + 0.01).all() and (high > joints.max(axis=0) - 0.01).all(), (hand, part)
        assert extent(drawn(scene, hand, SHADOW)) > 0.05
    assert abs(drawn(scene, 1, SKIN).mean(axis=0)[0] - drawn(scene, 0, SKIN).mean(axis=0)[0] - ASIDE[0]) < 0.06


def test_markers_are_painted_on_the_bones_of_their_own_hand(scene, state):
    scene.show_state(state)
    left = hands_of(two_hand_rig())[1]
    for k, marker in enumerate(left.markers.markers[:5]):
        own = (looks(scene, 1, MARKERS)[:, :3] == marker.display_rgb).all(axis=1)
        body = drawn(scene, 1, MARKERS)[own]
        tip, joint = (to_display(state.other.joint_positions[4 + 4 * k - back]) for back in (0, 1))
        bone = (tip - joint) / np.linalg.norm(tip - joint)
        assert np.ptp(body @ bone) > 1.2 * np.ptp(body @ np.cross(bone, [0.6, 0.8, 0.0])), "a ball, not a fingertip"
    assert len(drawn(scene, 0, MARKERS)) == len(drawn(scene, 1, MARKERS))


def test_each_hand_is_drawn_as_it_is_known(scene, state):
    guessed = replace(state.other, joint_knowledge=np.full(21, 2, np.uint8))
    scene.show_state(replace(state, joint_knowledge=np.zeros(21, np.uint8), other=guessed))
    assert (looks(scene, 0, SKELETON)[:, 3] == 255).all() and (looks(scene, 1, SKELETON)[:, 3] < 255).all()


@pytest.mark.parametrize(("gone", "there"), [("left", 0), ("right", 1)])
def test_nothing_is_left_of_a_hand_that_is_lost(scene, engine, gone, there):
    scene.show_state(engine.state(T_S))
    engine.gone = {gone}
    lost = engine.state(T_S)
    scene.show_state(lost)
    for part in range(5):
        vertices = drawn(scene, 1 - there, part)
        assert np.isfinite(vertices).all() and extent(vertices) == 0.0, part
        assert extent(drawn(scene, there, part)) > 0.05, part
    engine.gone = set()
    scene.show_state(engine.state(T_S))
    assert extent(drawn(scene, 1 - there, SKIN)) > 0.05


def test_a_tracker_of_one_hand_leaves_the_other_ones_markers_as_points(scene, state):
    scene.show_state(replace(state, other=None))
    assert extent(drawn(scene, 0, SKIN)) > 0.05 and extent(drawn(scene, 1, MARKERS)) > 0.05
    assert extent(drawn(scene, 1, SKIN)) == extent(drawn(scene, 1, SKELETON)) == 0.0


def test_a_rig_of_one_hand_takes_the_other_one_away_and_back(scene, state):
    scene.show_state(state)
    alone = FakeEngine(one_hand_rig(), clock=lambda: 0.0).state(T_S)
    scene.show_state(alone)  # the engine has changed over already, the window has not
    assert scene.state is None and extent(drawn(scene, 0, SKIN)) == extent(drawn(scene, 1, SKIN)) == 0.0
    scene.show_rig(one_hand_rig())
    scene.show_state(state)  # one that was still on its way
    assert scene.state is None
    scene.show_state(alone)
    assert len(scene.actors.items) == 5 and extent(drawn(scene, 0, SKIN)) > 0.05
    assert sum(item in scene.actors.items for item in scene.items) == 5
    scene.show_rig(two_hand_rig())
    scene.show_state(state)
    assert len(scene.actors.items) == 10 and extent(drawn(scene, 1, SKIN)) > 0.05


def test_uncertainty_is_chosen_for_both(scene, state):
    scene.show_state(state)
    scene.show_ellipsoids(None)
    assert all(len(drawn(scene, hand, ELLIPSOIDS)) == 0 < len(drawn(scene, hand, SKIN)) for hand in (0, 1))
    scene.show_ellipsoids(EllipsoidChoice(joints=False, fingertips=False))
    for hand in (0, 1):
        spans = np.ptp(drawn(scene, hand, ELLIPSOIDS).reshape(27, -1, 3), axis=1).max(axis=1)
        assert (spans > 0.0).tolist() == 21 * [False] + 6 * [True], "16 joints, 5 fingertips, 6 markers"
    far = replace(state.other, joint_covariances=np.tile(np.eye(3), (21, 1, 1)))
    scene.show_ellipsoids(EllipsoidChoice())
    scene.show_state(state)
    before = scene.actors.cut
    scene.show_state(replace(state, other=far))
    assert scene.actors.cut and not before, "the key says so whichever hand's ellipsoid was cut"


def test_framing_shows_every_finger_of_both_hands(scene, engine, state):
    scene.show_state(state)
    scene.frame_hand()
    pixels = scene.to_widget(np.concatenate([state.joint_positions, state.other.joint_positions]))
    assert (pixels > 0).all() and (pixels < [scene.width(), scene.height()]).all()
    both = scene.cameraParams()["distance"]
    engine.gone = {"right"}
    left = engine.state(T_S)
    scene.show_state(left)
    scene.frame_hand()
    assert scene.cameraParams()["distance"] == pytest.approx(0.42) and both > 0.5
    centre = scene.cameraParams()["center"]
    joints = to_display(left.other.joint_positions)
    assert [centre.x(), centre.y(), centre.z()] == pytest.approx(0.5 * (joints.min(axis=0) + joints.max(axis=0)))


def test_the_mouse_tells_which_hand_a_joint_is_of(scene, state):
    scene.show_state(state)
    scene.frame_hand()
    pixels = scene.to_widget(np.stack([state.joint_positions[14], state.other.joint_positions[14]]))
    told = [scene.tool_tip_at(QPoint(round(x), round(y))) for x, y in pixels]
    assert told[0].startswith("right ring PIP joint") and told[1].startswith("left ring PIP joint")


def test_every_marker_has_one_label(scene, state):
    scene.show_state(state)
    places, texts = scene.marker_labels()
    assert sorted(texts) == sorted(two_hand_rig().markers.ids)
    assert np.asarray(places) == pytest.approx(to_display(state.marker_positions))


def test_of_landmarks_wrist_and_fingertips_have_labels(themed, qtbot):
    rig, view = landmark_rig(), SceneView(DARK)
    qtbot.addWidget(view)
    view.show_rig(rig)
    state = no_hand(0, Condition.TRACKING, tuple(node.name for node in rig.nodes), markers=rig.markers.ids)
    view.show_state(replace(state, marker_positions=np.zeros((21, 3))))
    assert len(view.marker_labels()[1]) == len(view.marker_labels()[0]) == 6


def test_both_stand_on_a_table(state):
    shown = camera_like_state(state, "z")
    other = camera_like_state(replace(state.other), "z")
    for name in ("joint_positions", "marker_positions", "world_from_palm", "joint_covariances"):
        np.testing.assert_array_equal(getattr(shown.other, name), getattr(other, name))
        assert not np.array_equal(getattr(shown.other, name), getattr(state.other, name))


def test_hands_are_called_by_their_sides():
    rig = two_hand_rig()
    assert hand_names(rig) == ("right", "left")
    assert hand_names(None) == hand_names(one_hand_rig()) == ("",)
    assert hand_names(msgspec.structs.replace(rig, tracker=TrackerSettings(kind="classic"))) == ("",)
    assert hand_names(msgspec.structs.replace(rig, other_hand=rig.hand)) == ("first right", "other right")


@pytest.fixture(scope="module")
def two_hands_window(make_shared_bench):
    return make_shared_bench(FakeBackend(TwoHandsEngine(running=False)))


@pytest.fixture
def two_hands(two_hands_window):
    """The window on a rig with two hands, tracking."""
    two_hands_window.backend.engine.gone = set()
    two_hands_window.track()
    return two_hands_window


def test_the_panel_shows_the_angles_of_the_hand_that_is_chosen(two_hands):
    parts, engine = two_hands.window.screen_parts, two_hands.backend.engine
    right, left = parts.hand.choice.buttons
    assert left.isVisible() and left.x() < right.x() and right.isChecked()
    engine.running = False
    two_hands.until(lambda: two_hands.window.toolbar.badge.word == "IDLE")
    state = engine.state(T_S)
    for button, one in ((left, state.other), (right, state)):
        two_hands.click(button)
        parts.hand.show_state(state)
        assert [cell.text().partition(" ")[0] for cell in parts.hand.cells] == [
            f"{round(np.degrees(angle))}" for angle in one.angles]
    engine.gone = {"left"}
    parts.hand.show_state(engine.state(T_S))
    assert "It is LOST" in left.toolTip() and "It is TRACKING" in right.toolTip()
    assert parts.hand.cells[5].text() != "–"
    two_hands.click(left)
    parts.hand.show_state(engine.state(T_S))
    assert {cell.text() for cell in parts.hand.cells} == {"–"} and parts.hand.palm.text() == "unknown"
    parts.hand.show_state(None)
    assert "It is IDLE" in left.toolTip() and parts.hand.palm.text() == "–"


def test_the_choice_of_hands_goes_with_the_rig(two_hands):
    parts, engine = two_hands.window.screen_parts, two_hands.backend.engine
    two_hands.click(parts.hand.choice.buttons[1])
    parts.show_rig(one_hand_rig())
    assert not parts.hand.choice.isVisible() and parts.hand.choice.buttons[0].isChecked()
    parts.hand.show_state(FakeEngine(one_hand_rig()).state(T_S))
    assert parts.hand.cells[5].text() != "–"
    parts.show_rig(engine.rig)
    assert parts.hand.choice.isVisible()


def test_the_view_goes_near_once_both_are_there_and_the_word_counts_both(two_hands):
    scene, engine = two_hands.window.screen_parts.scene, two_hands.backend.engine
    two_hands.until(lambda: scene.cameraParams()["distance"] < 1.0)
    engine.gone = {"left"}
    two_hands.until(lambda: two_hands.window.toolbar.badge.word == "PARTIAL")
    scene.reset_view()
    engine.session += 1
    two_hands.see_newer_states()
    far = scene.cameraParams()["distance"]
    assert far > 1.0
    engine.gone = set()
    two_hands.until(lambda: scene.cameraParams()["distance"] < far)
