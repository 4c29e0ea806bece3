"""Two bare hands at once, with nodes that search drawn images: found, tracked, lost, one before the other."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
import numpy as np
import pytest
from bare_scenes import DISTANCE_M, ShownNodes, model_and_surface, near, poses, rig_of
from pictures import picture_of, taken, two_cameras, wall
from shipped_rig import LEFT_HAND

from rhot_app.barehand.observations import EdgeFrame, SliceRequest
from rhot_app.errors import RigError
from rhot_app.evaluation.contour_tracker import FIRST_NS, PERIOD_NS
from rhot_app.hand.kinematics import forward
from rhot_app.hand.skeleton import HandPose
from rhot_app.project import Rig, TrackerSettings, load_rig, save_rig, with_tracker
from rhot_app.state import Condition, HandState
from rhot_app.tracking.scene import make_tracker
from rhot_node.detect.edges import find_edges
from rhot_node.detect.foreground import learn_background, skin_foreground
from rhot_node.wire.search import SLICES_MAX

SIDES = "right", "left"
ASIDE_M = 0.1
CAMERAS = two_cameras(distance=DISTANCE_M)
WALLS = [wall(camera, 10 * k + 1, False) for k, camera in enumerate(CAMERAS)]
EMPTY = [taken(one, 0) for one in WALLS]


def two_bare_hands(shown: dict[str, HandPose] | None = None) -> Rig:
    """A rig whose hands are shown poses near `shown`, by default HOME."""
    rig = rig_of(CAMERAS, shown=[near(one, k) for k, one in enumerate((shown or HOME).values())])
    return msgspec.structs.replace(rig, other_hand=LEFT_HAND, tracker=msgspec.structs.replace(
        rig.tracker, kind="estimator", observe="contours"))


def at(side: str, place: Sequence[float], t_s: float = 0.0) -> HandPose:
    """A hand in the motion that it makes, its palm's middle at `place` from the middle of the scene, m."""
    pose = poses("spread" if side == "right" else "pinch", (t_s,), side)[0]
    world = pose.world_from_palm.copy()
    middle = forward(model_and_surface(side)[0], pose).joints[[0, 9]].mean(axis=0)
    world[:3, 3] += np.array([0.0, -0.02, DISTANCE_M]) + place - middle
    return HandPose(world, pose.angles)


def shown(hands: dict[str, HandPose], number: int) -> list[np.ndarray]:
    return [picture_of([(model_and_surface(side)[1], pose) for side, pose in hands.items()], camera, WALLS[c], number)
            for c, camera in enumerate(CAMERAS)]


def states_of(state: HandState) -> dict[str, HandState]:
    assert state.other is not None
    return {"right": state, "left": state.other}


def error_mm(state: HandState, side: str, pose: HandPose) -> float:
    truth = forward(model_and_surface(side)[0], pose).joints
    return 1e3 * float(np.mean(np.linalg.norm(state.joint_positions - truth, axis=1)))


HOME = {side: at(side, (sign * ASIDE_M, 0.0, 0.0)) for side, sign in zip(SIDES, (1.0, -1.0), strict=True)}


@pytest.fixture(scope="module")
def still() -> list[np.ndarray]:
    return shown(HOME, 0)


@pytest.mark.study("rhot_app/barehand", "rhot_app/tracking/contours")
@pytest.mark.parametrize("forget", [False, True], ids=["live", "from a log"])
def test_both_hands_are_found_and_one_leaves_and_returns(still: list[np.ndarray], forget: bool) -> None:
    nodes = ShownNodes(two_bare_hands(), EMPTY, forget=forget)
    nodes.show(EMPTY, 3)
    assert nodes.states[-1].condition == nodes.states[-1].other.condition == Condition.SEARCHING
    nodes.show_until_tracked(still)
    nodes.show(still, 12)
    limit_mm = 8.0 if forget else 2.0  # a log has the slices of the hands as they were expected
    assert all(error_mm(one, side, HOME[side]) < limit_mm for side, one in states_of(nodes.states[-1]).items())
    assert nodes.states[-1].other.t_master_ns == nodes.states[-1].t_master_ns
    assert all(len(request.slices) > 300 for request in nodes.asked)
    seen = nodes.tracker.seen()
    assert sorted((one.hand, one.camera) for one in seen) == sorted(
        (hand, node.name) for hand in (0, 1) for node in rig_of(CAMERAS).nodes)
    for _ in range(20):
        nodes.show(shown({"right": HOME["right"]}, 1))
        right = nodes.states[-1]
        assert right.tracked and error_mm(right, "right", HOME["right"]) < limit_mm + 1.0, "it goes on undisturbed"
    assert nodes.states[-1].other.condition is Condition.LOST
    assert np.isnan(nodes.states[-1].other.joint_positions).all()
    nodes.show_until_tracked(still)
    times_ns = [state.t_master_ns for state in nodes.states if state.tracked]
    assert (np.diff(times_ns) > 0).all()


@pytest.mark.study("rhot_app/barehand", "rhot_app/tracking/contours")
def test_both_hands_are_tracked_after_one_has_occluded_the_other() -> None:
    """The left hand passes 6 cm before the right one, which rests in its start pose, and covers all of it."""
    hands = {"right": at("right", (0.0, 0.0, 0.03)), "left": at("left", (-0.13, 0.0, -0.03))}
    nodes = ShownNodes(two_bare_hands(hands), EMPTY)
    nodes.show_until_tracked(shown(hands, 0))
    errors = []
    way = np.linspace(0.0, 1.0, 50)
    for x_m in np.append(-0.13 + 0.26 * (3.0 * way**2 - 2.0 * way**3), np.full(30, 0.13)):
        hands["left"] = at("left", (x_m, 0.0, -0.03))
        nodes.show(shown(hands, nodes.number))
        states = states_of(nodes.states[-1])
        assert states["left"].tracked
        errors.append({side: error_mm(one, side, hands[side]) for side, one in states.items()})
    left = [one["left"] for one in errors]
    assert np.median(left) < 2.0, "the nearer one goes on; the other may be lost while it is hidden"
    assert all(error < 2.0 for error in errors[-1].values()), "neither is taken for the other one"
    assert nodes.states[-1].t_master_ns == FIRST_NS + (nodes.number - 1) * PERIOD_NS


def test_edges_requested_for_one_hand_alone_are_left_out() -> None:
    """The rig has got a second hand while answers were under way."""
    tracker = make_tracker(two_bare_hands())
    slices = np.tile([100.0, 100.0, 1.0, 0.0, 5.0], (3, 1))
    edges = find_edges(EMPTY[0], slices, learn_background(skin_foreground(), [EMPTY[0]]), 2.0)
    request = SliceRequest(0, slices, 8, ("a place", "a contour"))
    tracker.ingest(EdgeFrame(0, FIRST_NS, 0, FIRST_NS, 0.0, 0.0, request, edges))
    assert tracker.solve() is None


def test_the_slices_of_both_hands_fit_into_a_request(monkeypatch: pytest.MonkeyPatch) -> None:
    """Hands so near that each alone would ask for more than its half."""
    close = {side: at(side, (x_m, 0.0, 0.28 - DISTANCE_M)) for side, x_m in zip(SIDES, (0.07, -0.07), strict=True)}
    nodes = ShownNodes(two_bare_hands(close), EMPTY)
    monkeypatch.setattr("rhot_app.tracking.contours.requests.STEP_M", 1e-3)
    nodes.show(shown(close, 0), 8)
    assert all(SLICES_MAX // 2 < len(request.slices) <= SLICES_MAX for request in nodes.asked)


def test_a_rig_of_two_bare_hands_is_saved_and_only_one_hand_may_have_markers(tmp_path) -> None:
    rig = two_bare_hands()
    save_rig(tmp_path / "rig.json", rig)
    assert load_rig(tmp_path / "rig.json") == rig
    assert with_tracker(rig, "classic").other_hand is not None, "it tracks the first hand"
    make_tracker(msgspec.structs.replace(rig, tracker=TrackerSettings("estimator", observe="both")))
    text = (tmp_path / "rig.json").read_text().replace('"contours"', '"markers"')
    (tmp_path / "rig.json").write_text(text)
    with pytest.raises(RigError, match=r"not both wear markers.*bare hands"):
        load_rig(tmp_path / "rig.json")
