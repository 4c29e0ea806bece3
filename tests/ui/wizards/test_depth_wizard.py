"""The depth wizard: a marker held at measured distances, from the first page to the saved rig and back."""

from __future__ import annotations

import time

import msgspec
import numpy as np
import pytest
from fake_engine import FakeEngine, synthetic_rig
from paint_scene import PaintScene
from wizard_hand import HeldMarker
from wizard_rig import FakeRigClient

from rhot_app.calibration.verdict import Grade
from rhot_app.project import CameraCalibration, load_rig
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.wizards import depth
from rhot_app.ui.wizards.depth import DistanceStep
from rhot_app.ui.wizards.framework.drawing import Dots
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import from_bgr

DISTANCES_CM = (25.0, 30.0, 40.0, 50.0, 60.0, 70.0, 85.0, 100.0)


class Marker(HeldMarker):
    """A marker that is carried elsewhere while two seconds pass by its clock."""

    passed_s = 0.0

    def clock(self):
        return time.monotonic() + self.passed_s

    def carry(self, distance_m):
        self.distance_m = distance_m
        self.passed_s += 2.0


@pytest.fixture
def marker():
    return Marker(FakeEngine())


def test_from_distances_to_a_rig_that_uses_them(open_wizard, marker):
    rig = msgspec.structs.replace(synthetic_rig(), calibration=CameraCalibration("exact"))
    hands = open_wizard("depth", FakeRigClient(rig), make=lambda context: depth.make_wizard(context, marker.clock),
                        listen=marker.connect)
    page = hands.window.page
    hands.until(lambda: "calibrated cameras" in hands.hint)

    def measure(distance_cm):
        """Hold the marker there, enter the distance, take it."""
        count = len(page.distances.rows)
        marker.carry(0.01 * distance_cm)
        page.distance.setValue(distance_cm)
        expected_px = 0.075 * 530.0 / marker.distance_m
        hands.until(lambda: len(page.distances.disparities()) > 5
                    and abs(page.distances.disparities() - expected_px).max() < 1.0)
        hands.click(page.take_button)
        assert len(page.distances.rows) == count + 1, hands.window.step.problem

    assert not hands.frame.next_button.isEnabled()
    for distance_cm in (30.0, 60.0):
        measure(distance_cm)
    page.table.selectRow(0)
    hands.click(page.remove_button)
    assert [row.distance_m for row in page.distances.rows] == [pytest.approx(0.6)]
    hands.undo()
    assert page.distances.rows == [] and not hands.frame.next_button.isEnabled()
    for distance_cm in DISTANCES_CM:
        measure(distance_cm)
    assert page.table.records_model.rowCount() == len(DISTANCES_CM)
    hands.next()
    assert hands.title == "The law" and hands.window.page.charts.plots
    assert "replaces_calibration" in hands.verdict.codes
    hands.next()
    assert "replaces_calibration" in hands.verdict.codes and hands.verdict.grade is Grade.FAIR
    assert "distance from" in hands.window.page.table.text(0, 0)
    hands.use()
    saved = load_rig(hands.path).depth
    assert saved.mode == "disparity"
    assert saved.k == pytest.approx(0.075 * 530.0, rel=0.02) and saved.z == pytest.approx(-1.0, abs=0.01)
    hands.restore()
    assert load_rig(hands.path).depth.mode == "stereo"


def test_what_cannot_be_measured_is_said(marker):
    step = DistanceStep(synthetic_rig(), lambda seconds: [state for _ in range(20) for state in marker.poll()])
    marker.distance_m = None
    assert not step.capture()
    assert "thumb" in step.view().hint and "not seen" in step.view().hint
    marker.distance_m, marker.noise_px = 0.3, 5.0
    assert not step.capture()
    assert "moves" in step.view().hint and not step.rows


def test_the_chosen_marker_is_ringed_where_it_is_in_the_picture_shown(marker):
    """The states are those of other moments: what they say of the marker's place is not drawn."""
    scene = PaintScene()
    scene.moving = True
    step = DistanceStep(synthetic_rig(), lambda seconds: [marker.poll()[0]])
    index = step.rig.markers.ids.index("ring")
    step.marker, found = index, []
    for number in range(6):
        pictures = {name: Picture(name, scene.draw(node_id), number, 0, number)
                    for name, node_id in (("left", 1), ("right", 2))}
        step.accept_observation(step.observe(pictures))
        for name, annotated in step.view().annotated.items():
            assert annotated.picture is pictures[name]
            (dots,) = [mark for mark in annotated.overlay if isinstance(mark, Dots)]
            seen = FastDetector(step.rig.markers).detect(from_bgr(annotated.picture.bgr))[index]
            assert dots.points[0] == pytest.approx((seen.x, seen.y), abs=1.0)
            found.append(dots.points[0])
    assert np.linalg.norm(np.diff(found[::2], axis=0), axis=1).min() > 5.0
