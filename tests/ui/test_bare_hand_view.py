"""A bare hand in the camera panel: contour, slices and edges of the image that is shown, and of no other."""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
import pytest
from bare_scenes import poses, rig_of, scene
from PySide6.QtGui import QImage
from screen_pictures import check

from rhot_app.barehand.contour_residual import seen_contour
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.engine.status import TOPIC_CONTOUR, Preview, decode, encode
from rhot_app.state import SeenContour
from rhot_app.ui.backend.live import Live
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.panels.camera_panel import OUTLINE_COLOUR, CameraPanel

T_NS, T_NODE_NS = 5_000_000_000, 77_000_000_000


@pytest.fixture(scope="module")
def hand():
    """A rig, its pictures as previews, and what a tracker has seen in them, as it comes from the engine."""
    (pose,) = poses("spread", (0.4,))
    cameras, images, _ = scene(pose)
    rig = rig_of(cameras)
    tracker = BareHandTracker(rig)
    tracker.start(pose, T_NS)
    tracker.step(images, [T_NS, T_NS])
    previews, contours = [], []
    for node, image, frame in zip(rig.nodes, images, tracker.frames, strict=True):
        small = cv2.resize(image[:, :, ::-1], (320, 240), interpolation=cv2.INTER_AREA)
        previews.append(Preview(node.name, T_NS, 640, 480, cv2.imencode(".jpg", small)[1].tobytes(), T_NODE_NS))
        seen = seen_contour(node.name, T_NS, frame, tracker.filter.newest.state, T_NODE_NS)
        contours.append(decode(TOPIC_CONTOUR, encode(seen)))
    return rig, previews, contours


@pytest.fixture
def panel(qtbot, themed, hand):
    panel = CameraPanel(DARK)
    qtbot.addWidget(panel)
    panel.show_rig(hand[0])
    panel.resize(640, 960)
    panel.show()
    return panel


def greens(image: QImage) -> int:
    """Pixels of the outline's colour."""
    rgb = image.convertToFormat(QImage.Format.Format_RGB888)
    rows = np.frombuffer(rgb.constBits(), np.uint8).reshape(rgb.height(), rgb.bytesPerLine())[:, :3 * rgb.width()]
    wanted = [int(OUTLINE_COLOUR[k:k + 2], 16) for k in (1, 3, 5)]
    return int(np.count_nonzero((np.abs(rows.reshape(-1, 3).astype(int) - wanted) < 40).all(axis=1)))


def test_a_bare_hands_contour_lies_over_its_picture(panel, hand):
    _, previews, contours = hand
    live = Live()
    for preview, contour in zip(previews, contours, strict=True):
        assert isinstance(contour, SeenContour)
        live.previews[preview.camera] = preview
        live.contours.append(contour)
    panel.refresh(live)
    image = panel.grab().toImage()
    assert greens(image) > 500
    check("bare-hand", image, 60)


def test_a_contour_of_another_moment_is_not_shown(panel, hand):
    _, previews, contours = hand
    live = Live()
    live.previews[previews[0].camera] = previews[0]
    panel.refresh(live)
    assert greens(panel.grab().toImage()) == 0
    late = replace(previews[0], t_master_ns=T_NS + 8_000_000, t_node_ns=T_NODE_NS + 8_000_000)
    live.contours.append(contours[0])
    live.previews[late.camera] = late
    panel.refresh(live)
    assert greens(panel.grab().toImage()) == 0, "the hand has moved on since"
    live.previews[late.camera] = previews[0]
    panel.refresh(live)
    assert greens(panel.grab().toImage()) > 250


def test_the_pose_that_a_hand_is_to_take_is_shown_in_every_picture_until_it_is_followed(panel, hand):
    _, previews, contours = hand
    live = Live()
    later = replace(previews[0], t_master_ns=T_NS + 8_000_000, t_node_ns=T_NODE_NS + 8_000_000)
    live.previews[later.camera] = later
    before = panel.grab().toImage()
    live.contours.append(replace(contours[0], shown=True, slices=contours[0].slices[:0]))
    panel.refresh(live)
    assert panel.views[later.camera].contours and greens(panel.grab().toImage()) == 0
    assert panel.grab().toImage() != before
    live.contours.append(contours[0])
    live.previews[later.camera] = replace(later, t_node_ns=T_NODE_NS + 16_000_000)
    panel.refresh(live)
    assert not panel.views[later.camera].contours, "it is followed now"
