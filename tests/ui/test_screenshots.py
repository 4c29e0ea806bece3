"""Pictures of every page for the guide. They are written when RHOT_UPDATE_SCREENSHOTS=1; otherwise the pages must show
something, and the pictures must be there."""

from __future__ import annotations

import msgspec
import pytest
from fake_backend import FakeBackend
from fake_engine import FakeEngine, synthetic_rig
from screen_pictures import SIZE, colours_in, picture_of
from two_hands_engine import TwoHandsEngine

from rhot_app.engine.status import Advice
from rhot_app.project import TrackerSettings, load_rig
from rhot_app.sources.discovery import Search, Sighting, conflicts, together
from rhot_app.sources.pairing import Introduction, NodeAddress
from rhot_app.ui.backend.ping import NodeAnswer
from rhot_app.ui.dialogs.nodes_dialog import NodesDialog, PairDialog
from rhot_app.ui.dialogs.rig_dialog import RigDialog
from rhot_app.ui.models.palette import DARK
from rhot_node.files import resource_path
from rhot_node.network.presence import Presence
from rhot_node.wire.messages import NodeState, TrustState

WRIST = "Right camera saw no wrist marker for 12 s: it is behind the forearm. Turn the hand or add rhot8."


@pytest.fixture
def shown(tracking):
    """The shared window at the size of the pictures, in the dark scheme."""
    tracking.window.resize(SIZE)
    tracking.window.move(0, 0)
    if tracking.window.settings.scheme != "dark":
        tracking.window.appearance.set_scheme("dark")
    tracking.window.screen_parts.scene.reset_view()
    tracking.window.docks.arrange()
    tracking.backend.engine.session += 1
    return tracking


def scene_colours(bench) -> int:
    """Colours inside the scene alone: a scene without OpenGL has one."""
    scene = bench.window.screen_parts.scene
    image = picture_of(bench.window)
    corner = scene.mapTo(bench.window, scene.rect().topLeft())
    return colours_in(image.copy(corner.x(), corner.y(), scene.width(), scene.height()))


def test_first_page(bench):
    bench.window.resize(SIZE)
    bench.keep("welcome", 20)


def test_progress_page(bench):
    bench.window.resize(SIZE)
    bench.backend.gate.clear()
    bench.window.welcome.twin_button.click()
    bench.until(lambda: bench.window.welcome.progress_bar.value() == 40)
    bench.keep("starting", 12)


@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_tracking(shown, scheme):
    if scheme != "dark":
        shown.window.appearance.set_scheme(scheme)
    shown.until(lambda: scene_colours(shown) > 40)
    shown.keep("tracking" if scheme == "dark" else "tracking-light", 80, settle_s=20.0)


def test_something_is_hidden(shown):
    shown.backend.engine.hidden = {"wrist": "right", "ring": "both"}
    shown.backend.engine.advice = (Advice("warning", WRIST),)
    shown.until(lambda: shown.said(WRIST))
    shown.window.screen_parts.scene.frame_hand()
    shown.keep("partial", 80)


def test_the_engine_is_gone(shown):
    shown.backend.gate.clear()
    shown.backend.engine.dead = True
    shown.until(lambda: shown.window.toolbar.badge.word == "NO ENGINE")
    shown.keep("no-engine", 40)


def test_scene_alone(shown):
    shown.window.actions_.alone.trigger()
    shown.window.screen_parts.scene.frame_hand()
    shown.keep("scene", 60)


def test_what_is_real(make_bench):
    rig = msgspec.structs.replace(synthetic_rig(), tracker=TrackerSettings(kind="estimator", float_scale=True))
    bench = make_bench(FakeBackend(FakeEngine(rig, running=False)))
    bench.window.resize(SIZE)
    bench.track()
    bench.window.actions_.cloud_sizes[1].trigger()
    bench.window.screen_parts.scene.frame_hand()
    bench.keep("uncertainty", 80)
    bench.window.actions_.tracker.trigger()
    dialog = bench.window.dialogs.tracker
    bench.until(dialog.size_button.isEnabled)
    bench.keep("tracker", 12, lambda: dialog.grab().toImage())


def test_not_calibrated(make_bench):
    rig = load_rig(resource_path("rigs", "two_pis.json"))
    bench = make_bench(FakeBackend(FakeEngine(rig, running=False)))
    bench.window.resize(SIZE)
    bench.until(lambda: bench.window.welcome.twin_button.isVisible())
    bench.click(bench.window.welcome.twin_button)
    bench.until(lambda: bench.window.toolbar.badge.word == "TRACKING" and len(bench.window.advice.texts) == 2)
    bench.window.screen_parts.scene.frame_hand()
    bench.keep("not-calibrated", 80, settle_s=8.0)


def test_two_hands(make_bench):
    bench = make_bench(FakeBackend(TwoHandsEngine(running=False)))
    bench.window.resize(SIZE)
    bench.track()
    bench.window.screen_parts.scene.frame_hand()
    bench.keep("two-hands", 80, settle_s=8.0)


def connecting() -> NodesDialog:
    """Three nodes were found, two of them chosen by their names; one of these is not paired yet."""
    def find(progress) -> Search:
        nodes = [("left", 1, TrustState.PAIRED), ("right", 2, TrustState.UNPAIRED), ("right", 3, TrustState.OPEN)]
        seen = together(Sighting(Presence(node_id, 1, name, 47800, 47801, 47802, 47803, trust),
                                 f"192.168.1.{10 + node_id}", NodeState.READY) for name, node_id, trust in nodes)
        return Search(seen, conflicts(seen), ())

    def ask(addresses: list[NodeAddress]) -> list[NodeAnswer]:
        who = [Introduction(k, name, "ready", "paired", 1, 2, 3, 4) for k, name in ((1, "left"), (2, "right"))]
        return [NodeAnswer(address, one, one.name == "left") for address, one in zip(addresses, who, strict=True)]
    dialog = NodesDialog(DARK, find=find, ask=ask)
    dialog.found.searched.connect(lambda: dialog.choose(1, dialog.found.table.records[1]))
    return dialog


def test_dialogs(qtbot, bench):
    pairing = PairDialog("left", NodeAddress("192.168.1.11"), lambda address, code: "left")
    for name, dialog in (("connect-nodes", connecting()), ("pair-node", pairing),
                         ("rig-cameras", RigDialog(FakeEngine().rig, "cameras")),
                         ("rig-markers", RigDialog(FakeEngine().rig, "markers"))):
        qtbot.addWidget(dialog)
        dialog.show()
        qtbot.waitExposed(dialog)
        bench.keep(name, 10, lambda dialog=dialog: dialog.grab().toImage(), settle_s=0.2)
    bench.window.open_guide("window")
    bench.keep("guide", 12, lambda: bench.window.dialogs.guide.grab().toImage())
