"""The warm-up before the first frame shows a hand, so that all that a hand needs is compiled by then."""

import msgspec
import pytest
from modelled_hand import model_rig
from synthetic_rig import make_rig

from rhot_app.engine.pipeline import warm_up
from rhot_app.project import OTHER_HAND, CameraPose
from rhot_app.state import Condition
from rhot_app.tracking.scene import make_tracker
from rhot_app.tracking.tracker import Tracker


class Spy(Tracker):
    """A tracker that remembers what it said."""

    def __init__(self, tracker):
        self.tracker, self.said = tracker, []

    def ingest(self, observations):
        self.tracker.ingest(observations)

    def solve(self):
        state = self.tracker.solve()
        self.said += [] if state is None else [state]
        return state

    def reset(self):
        self.tracker.reset()
        self.said.append(None)


def table_rig():
    """Cameras 1 m above a table, looking down; the rig frame is the table's."""
    rig = model_rig()
    nodes = tuple(msgspec.structs.replace(node, pose=CameraPose((0.0, 1.0, 0.0, 0.0), (0.1 * k, 0.2, 1.0)))
                  for k, node in enumerate(rig.nodes))
    return msgspec.structs.replace(rig, nodes=nodes, up="z")


def two_hands():
    rig = model_rig()
    others = tuple(msgspec.structs.replace(marker, id=f"left.{marker.id}", role=OTHER_HAND + marker.role)
                   for marker in rig.markers.markers)
    return msgspec.structs.replace(rig, other_hand=model_rig(side="left").hand, markers=msgspec.structs.replace(
        rig.markers, markers=rig.markers.markers + others))


@pytest.mark.parametrize("rig", [make_rig(), model_rig(), table_rig(), two_hands()],
                         ids=["classic", "estimator", "table", "two hands"])
def test_the_warm_up_tracks_the_rigs_hands_and_forgets_them(rig):
    spy = Spy(make_tracker(rig))
    warm_up(spy, rig)
    last = spy.said[-2]
    assert last.condition is Condition.TRACKING
    assert rig.other_hand is None or last.other.condition is Condition.TRACKING
    assert spy.said[-1] is None and spy.tracker.solve() is None
    assert spy.tracker.newest_frames() == (None, None)
