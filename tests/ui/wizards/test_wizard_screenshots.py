"""Pictures of the wizards' pages for the guide. They are written when RHOT_UPDATE_SCREENSHOTS=1; otherwise the pages
must show something, and the pictures must be there."""

from __future__ import annotations

import msgspec
import pytest
from colour_scenes import PAINTS
from fake_engine import FakeEngine, synthetic_rig
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


def test_filters(open_wizard):
    import test_filter_wizard as filter_wizard
    from wizard_hand import RecordingAsker

    from rhot_app.ui.wizards.filters import make_plan

    rig = filter_wizard.make_rig()
    asker = RecordingAsker(rig, write=lambda log: filter_wizard.write_movement(rig, log))
    hands = open_wizard(make_plan, rig, asker, listen=filter_wizard.MovingHand(FakeEngine()).connect)
    for name in ("still", "fast"):
        hands.window.step.seconds = 3.0
        hands.window.step.capture()
        hands.until(lambda: hands.window.step.phase == "recording")
        hands.run(2.3)
        keep(hands, f"filters-{name}")
        hands.until(lambda: hands.window.step.phase == "recorded", timeout_s=20.0)
        hands.next()
    hands.until(lambda: hands.window.step.report is not None, timeout_s=120.0)
    keep(hands, "filters-result")
    hands.next()
    keep(hands, "filters-accept", 8)


def test_bones(open_wizard):
    import test_bones_wizard as bones_wizard
    from wizard_hand import RecordingAsker

    from rhot_app.ui.wizards.bones import make_plan

    rig = bones_wizard.make_rig()
    asker = RecordingAsker(rig, write=lambda log: None)
    hands = open_wizard(make_plan, rig, asker, listen=bones_wizard.FreeHand().connect)
    page = hands.window.page
    page.boxes["index.proximal"].setValue(44.0)
    page.boxes["index.medial"].setValue(25.5)
    keep(hands, "bones-entry", 10)
    for _ in range(2):
        hands.window.step.undo()
    hands.next()
    movement = hands.window.step
    movement.seconds = 8.0
    movement.capture()
    hands.until(lambda: movement.phase == "recording")
    hands.run(6.5)
    keep(hands, "bones-movement")
    hands.until(lambda: movement.phase == "recorded")
    movement.log = None  # the fit of the twin's own tracks is shown instead of one of a log
    hands.next()
    hands.window.step.take_result(bones_wizard.twin_report(rig))
    keep(hands, "bones-hand", 12)
    hands.next()
    keep(hands, "bones-accept", 8)
