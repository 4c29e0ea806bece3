"""Rigs that the estimator cannot work with are refused with a sentence."""

import msgspec
import pytest
from modelled_hand import model_rig

from rhot_app.errors import RigError
from rhot_app.project import DepthSettings
from rhot_app.tracking.scene import make_tracker

RIG = model_rig()


@pytest.mark.parametrize(("role", "said"), [
    ("elbow", r"marker '.*' has the role 'elbow'; a hand wears markers at thumb_tip"),
    (None, r"marker '.*' has no role; a hand wears markers at thumb_tip"),
    ("index_tip", r"markers 'index.*' and 'wrist' both have the role 'index_tip'")])
def test_a_marker_without_a_place_of_its_own_on_the_hand_is_refused(role, said):
    markers = (*RIG.markers.markers[:5], msgspec.structs.replace(RIG.markers.markers[5], role=role))
    rig = msgspec.structs.replace(RIG, markers=msgspec.structs.replace(RIG.markers, markers=markers))
    with pytest.raises(RigError, match=said):
        make_tracker(rig)


def test_a_rig_without_calibration_is_refused():
    rig = msgspec.structs.replace(RIG, depth=DepthSettings(mode="disparity"))
    with pytest.raises(RigError, match=r"The estimator needs calibrated cameras.*tracker\.kind"):
        make_tracker(rig)


def test_a_rig_with_text_datagrams_is_refused():
    left, right = RIG.nodes
    rig = msgspec.structs.replace(RIG, nodes=(left, msgspec.structs.replace(right, text_datagrams=True)))
    with pytest.raises(RigError, match=rf"needs the time of every picture; node {right.name} .*tracker\.kind"):
        make_tracker(rig)
