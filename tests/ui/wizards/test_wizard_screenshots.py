"""Pictures of the wizards' pages for the guide. They are written when RHOT_UPDATE_SCREENSHOTS=1; otherwise the pages
must show something, and the pictures must be there."""

from __future__ import annotations

import msgspec
import pytest
from colour_scenes import PAINTS
from fake_engine import synthetic_rig
from paint_scene import PaintScene, compile_detector, other_colours
from screen_pictures import SIZE, check
from wizard_hands import Hands
from wizard_rig import FakeMemory, FakeRigAsker

from rhot_app.calibration.separability import SKIN
from rhot_app.ui.models.palette import DARK
from rhot_app.ui.wizards.plan import Kit
from rhot_app.ui.wizards.window import WizardWindow


@pytest.fixture
def open_wizard(themed):
    """Opens a wizard's window at the size of the pictures."""
    opened = []

    def open_it(make_plan, rig, asker, **given):
        settings = {node_id: msgspec.to_builtins(one) for node_id, one in asker.settings.items()}
        kit = Kit(rig, None, asker.connect, DARK, FakeMemory(), settings, **given)
        hands = Hands(WizardWindow(make_plan(kit), kit))
        hands.window.resize(SIZE)
        opened.append(hands)
        return hands

    yield open_it
    for hands in opened:
        hands.window.end().wait(5.0)
        hands.window.deleteLater()


def keep(hands, name, least_colours=20):
    """Take the picture of the page as it is now."""
    hands.run(0.4)
    check(name, hands.window.grab().toImage(), least_colours)


def test_colours(open_wizard):
    from rhot_app.ui.wizards.colours import make_plan

    compile_detector()
    paints = {**PAINTS, "little": (60, 110, 205)}
    scene = PaintScene(paints, clutter=[(40.0, 205.0, 16.0, (205, 70, 60)), (280.0, 30.0, 20.0, (60, 150, 90))])
    rig = synthetic_rig()
    rig = msgspec.structs.replace(rig, markers=other_colours(rig.markers))
    hands = open_wizard(make_plan, rig, FakeRigAsker(rig, scene.draw))
    step = hands.window.step
    hands.until(lambda: step._sights)
    for name in PAINTS:
        assert step.pick("left", *PaintScene.where(name), 0.0, 0.0), step.problem
    x, y = PaintScene.where("thumb")
    step.chosen = SKIN
    assert step.pick("left", x - 4, y + 40, 8.0, 20.0)
    scene.moving = True
    hands.until(lambda: step.view().bars[1].fraction > 0.7, timeout_s=60.0)
    scene.moving = False
    keep(hands, "colours-pick")
    hands.next()
    hands.until(lambda: hands.window.step.report is not None, timeout_s=60.0)
    hands.run(1.0)
    keep(hands, "colours-mask")
    hands.next()
    hands.until(lambda: hands.window.step.report is not None, timeout_s=60.0)
    keep(hands, "colours-apart")
    hands.next()
    keep(hands, "colours-accept", 10)
