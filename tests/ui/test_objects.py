"""Tracked objects in the window: what is drawn and said of them, and the Rig menu's entries, clicked."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from rhot_app.errors import RigError
from rhot_app.estimation.se3 import exp_so3
from rhot_app.geometry.transforms import rigid
from rhot_app.objects.object_file import CylinderShape, ObjectModel, SphereShape, cube, plate, save_object
from rhot_app.objects.state import ObjectState, Validity, unknown_object
from rhot_app.project import Rig, RigObject, load_rig, with_object
from rhot_app.ui.common.theme import scheme_named
from rhot_app.ui.panels.objects_panel import ObjectsPanel, object_lines
from rhot_app.ui.scene.object_actors import surface_of
from rhot_app.ui.tracked_objects import TrackedObjects
from rhot_node.files import resource_path

POSE = rigid(exp_so3([0.3, 0.2, 0.1]), [0.03, 0.0, 0.5])


def state(validity: Validity = Validity.TRACKED) -> ObjectState:
    covariance = np.diag([1e-8, 1e-8, 2e-8, 1e-6, 1e-6, 2e-6])
    return replace(unknown_object("cube", 1, validity), world_from_object=POSE, covariance=covariance,
                   velocity=np.zeros(6), distances=np.array([0.012, -0.001, 0.03, 0.04, 0.05]),
                   contacts=np.array([False, True, False, False, False]))


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    save_object(tmp_path / "cube.json", cube("cube", 60.0, 45.0, "DICT_APRILTAG_36h11"))
    return with_object(load_rig(resource_path("rigs", "two_pis.json")), tmp_path / "cube.json")


def test_the_panel_says_how_each_object_goes(qtbot: Any, rig: Rig) -> None:
    assert object_lines(state()) == ["cube: TRACKING, ±0.2 mm, ±0.1°",
                                     "thumb 12 mm, index touches, middle 30 mm, ring 40 mm, little 50 mm"]
    assert object_lines(unknown_object("cube", 1, Validity.LOST)) == ["cube: LOST"]
    panel = ObjectsPanel(scheme_named("dark"))
    qtbot.addWidget(panel)
    panel.show_rig(None)
    assert panel.isHidden()
    panel.show_rig(rig)
    assert not panel.isHidden() and len(panel.labels) == 1


@pytest.mark.parametrize("model", [
    cube("cube", 60.0, 45.0, "DICT_APRILTAG_36h11"), plate("plate", 2, 1, 30.0, 5.0, "DICT_4X4_50"),
    msgspec.structs.replace(plate("ball", 1, 1, 30.0, 0.0, "DICT_4X4_50"), shape=SphereShape(60.0)),
    msgspec.structs.replace(plate("can", 1, 1, 30.0, 0.0, "DICT_4X4_50"), shape=CylinderShape(60.0, 100.0))])
def test_a_surface_faces_outwards(model: ObjectModel) -> None:
    points, normals, faces = surface_of(RigObject("/nowhere.json", None, model))
    assert faces.max() < len(points) == len(normals)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)
    if model.shape is not None:
        assert (np.einsum("ni,ni->n", points, normals) > 0.0).all(), "of a convex body about the origin"
        size = 1e-3 * np.array([60.0, 60.0, 100.0 if model.name == "can" else 60.0])
        np.testing.assert_allclose(np.ptp(points, axis=0), size, rtol=0.02)


class FakeClient:
    """An engine with a rig."""

    def __init__(self, rig: Rig) -> None:
        self.rig, self.saved = rig, 0

    def command(self, name: str, **arguments: Any) -> dict[str, Any]:
        if name == "set_rig":
            self.rig = msgspec.convert(arguments["document"], Rig)
        self.saved += name == "save_rig"
        return {"document": msgspec.to_builtins(self.rig), "path": "/rig.json"}


def test_an_object_is_added_and_removed_by_the_menu(qtbot: Any, tmp_path: Path) -> None:
    from PySide6.QtCore import QObject, Signal
    from PySide6.QtGui import QAction
    from PySide6.QtWidgets import QMenu, QWidget

    save_object(tmp_path / "cube.json", cube("cube", 60.0, 45.0, "DICT_APRILTAG_36h11"))
    client, told = FakeClient(load_rig(resource_path("rigs", "two_pis.json"))), []

    class Link:
        def work(self, op: Any, done: Any, failed: Any) -> None:
            try:
                result = op(client)
            except RigError as exc:
                failed(str(exc))
            else:
                done(result)

    class Controller(QObject):
        rig_changed = Signal()
        opened = None
        link = Link()

        @property
        def rig(self) -> Rig:
            return client.rig

    window = QWidget()
    qtbot.addWidget(window)
    controller, add, menu = Controller(window), QAction(window), QMenu(window)
    objects = TrackedObjects(controller, add, menu, told.append, controller.rig_changed.emit, window)  # type: ignore[arg-type]
    assert not menu.menuAction().isEnabled()
    objects.choose = lambda: tmp_path / "cube.json"
    add.trigger()
    assert [model.name for model in client.rig.models] == ["cube"] and client.saved == 1
    add.trigger()
    assert told[-1].level == "error" and "cube" in told[-1].text, "the same one twice"
    assert [entry.text() for entry in menu.actions()] == ["cube"]
    menu.actions()[0].trigger()
    assert client.rig.objects == () and client.saved == 2
    assert not menu.menuAction().isEnabled()
