"""The background and skin wizard, clicked through on nodes that learn: empty scene, hand, verdict, what is kept."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from fake_engine import synthetic_rig
from patience import PATIENCE_S, eventually, settled
from wizard_rig import FakeRigClient

from rhot_app.errors import EngineError
from rhot_app.ui.models.proposal import restore_all, use_all
from rhot_app.ui.wizards import foreground
from rhot_app.ui.wizards.foreground import EmptyStep, SceneWatch, SkinStep, findings_of, mask_of, propose
from rhot_node.foreground_store import ForegroundStore
from rhot_node.network.pictures import PictureBox, encode_still

SKIN = (115, 140, 200)  # BGR


class LearningNodes(FakeRigClient):
    """Nodes with real stores that see a desk, and a hand once `hand` says so."""

    def __init__(self, folder):
        super().__init__(synthetic_rig(), self.picture)
        self.hand, self.broken = False, False
        self.failing = []  # node ids and requests
        self.stores = {node.node_id: ForegroundStore(folder / f"{node.name}.npz") for node in self.rig.nodes}

    def picture(self, node_id, t_s):
        rows = np.linspace(60, 130, 480)[:, None, None]
        bgr = np.broadcast_to(rows * (1.1, 1.0, 0.8), (480, 640, 3)).astype(np.uint8).copy()
        if self.hand:
            cv2.circle(bgr, (320 - 20 * node_id, 260), 60, SKIN, -1)
            for x in (-55, -25, 8, 40):
                cv2.line(bgr, (320 - 20 * node_id, 260), (320 - 20 * node_id + x, 120), SKIN, 22)
        return bgr

    def box(self, node_id):
        """What the node's camera sees next."""
        class Box(PictureBox):
            def next_still(box, timeout_s):  # noqa: N805
                from rhot_node.detect.image import from_bgr
                from rhot_node.network.pictures import Picture
                return Picture(from_bgr(self.picture(node_id, 0.0)), 1, 1)
        return Box(4.0)

    def command(self, name, *, timeout_s=3.0, **arguments):
        request = arguments.get("request", {})
        kind, node_id = request.get("request", ""), arguments.get("node_id")
        if name != "node" or not ("foreground" in kind or kind.startswith(("learn_", "state"))):
            return super().command(name, timeout_s=timeout_s, **arguments)
        if self.broken or (node_id, kind) in self.failing:
            raise EngineError(f"node {node_id} does not answer on its control channel.")
        store = self.stores[node_id]
        if kind == "state":
            return {"answer": {"foreground": store.report(640, 480)}}
        if kind == "learn_background":
            store.learn_background(self.box(node_id), request["seconds"], save=request["save"])
        elif kind == "learn_skin":
            return {"answer": {"found": store.learn_skin(self.box(node_id), save=request["save"])}}
        elif kind == "foreground_mask":
            mask, picture = store.mask(self.box(node_id))
            return {"answer": {"mask_bytes": len(mask.data), "number": picture.number, "t_node_ns": picture.t_node_ns},
                    "data": mask.data + encode_still(picture, "jpeg").data}
        elif kind == "save_foreground":
            store.save()
            self.saved.append(node_id)
        else:
            store.revert(earlier=request.get("earlier", False))
        return {"answer": {}}


@pytest.fixture
def nodes(tmp_path, monkeypatch):
    monkeypatch.setattr(foreground, "SECONDS", 0.1)
    return LearningNodes(tmp_path)


@pytest.fixture
def hands(open_wizard, nodes):
    return open_wizard("foreground", nodes, in_file=False)


def test_from_an_empty_scene_to_what_the_nodes_keep(hands, nodes):
    assert "Take the hand out" in hands.sentence and not hands.frame.next_button.isEnabled()
    hands.click(hands.window.page.learn_button)
    hands.until(lambda: hands.sentence.startswith("Learnt"))
    hands.next()
    nodes.hand = True
    assert "Hold your bare hand" in hands.sentence
    hands.click(hands.window.page.learn_button)
    hands.until(lambda: hands.window.step.view().done)
    for store in nodes.stores.values():
        assert store.report(640, 480)["skin"] == "learnt"
        assert not store.path.exists(), "nothing is kept before the last step"
    hands.keep("foreground-hand")
    hands.next()
    assert hands.window.page.table.records_model.rowCount() == 4
    hands.use()
    assert nodes.saved == [1, 2]
    assert all(ForegroundStore(store.path).report(640, 480)["background"] for store in nodes.stores.values())
    hands.restore()
    assert not any(store.report(640, 480)["background"] for store in nodes.stores.values())


def test_a_hand_that_was_there_all_the_time_is_noticed_and_not_found(hands, nodes):
    nodes.hand = True
    hands.click(hands.window.page.learn_button)
    hands.until(lambda: hands.verdict is not None)
    assert hands.verdict.codes == {"skin"} and not hands.window.step.view().done
    assert "empty?" in hands.sentence
    hands.next()
    hands.click(hands.window.page.learn_button)
    hands.until(lambda: hands.verdict is not None and "No skin" in hands.hint)
    assert "0.5 %" in hands.verdict.findings[0].sentence
    assert not hands.frame.next_button.isEnabled()


def scene(number, kind):
    """The desk in noise: empty, with a still thing of wood, or with something that moves."""
    rng = np.random.default_rng(number)
    rows = np.linspace(60, 130, 480)[:, None, None]
    bgr = rows * (1.1, 1.0, 0.8) * np.ones((1, 640, 1)) + rng.normal(0.0, 3.0, (480, 640, 3))
    if kind == "wood":
        bgr[100:250, 200:400] = (70, 104, 142)
    if kind == "moving":
        cv2.circle(bgr, (200 + 15 * number, 240), 40, (120, 40, 30), -1)
    if kind == "flicker":
        bgr *= 1.0 + 0.1 * (-1) ** number
    return np.clip(bgr, 0, 255).astype(np.uint8)


@pytest.mark.parametrize(("kind", "codes"), [("empty", set()), ("flicker", set()), ("wood", {"skin"}),
                                             ("moving", {"moves"})])
def test_a_scene_in_which_something_moves_or_is_of_skins_colour_is_not_called_empty(kind, codes):
    watch = SceneWatch()
    for number in range(8):
        watch.add(scene(number, kind))
    assert {finding.code for finding in watch.findings("left")} == codes


def test_closing_without_use_forgets_what_was_tried_out(hands, nodes):
    hands.click(hands.window.page.learn_button)
    hands.until(lambda: hands.sentence.startswith("Learnt"))
    hands.window.end().wait(PATIENCE_S)
    assert not any(store.report(640, 480)["background"] for store in nodes.stores.values())


def test_closing_while_the_scene_is_learnt_keeps_the_old_one(hands, nodes, monkeypatch):
    old = nodes.stores[1]
    old.learn_background(nodes.box(1), 0.1)
    eventually(lambda: not old.learning)
    before = old.current.mean.copy()
    nodes.hand = True  # so that the scene is another one
    monkeypatch.setattr(foreground, "SECONDS", 0.4)
    hands.click(hands.window.page.learn_button)
    hands.until(lambda: old.learning)
    hands.window.end().wait(PATIENCE_S)
    assert settled(lambda: np.array_equal(old.current.mean, before) and not nodes.stores[2].current.mean.size, 0.8)


def test_a_node_that_does_not_answer_is_named(hands, nodes):
    nodes.broken = True
    hands.click(hands.window.page.learn_button)
    hands.until(lambda: "does not answer" in hands.hint)
    assert hands.window.page.learn_button.isEnabled() and not hands.frame.next_button.isEnabled()


@pytest.mark.parametrize(("boxes", "code"), [
    ([], "nothing"), ([(0, 0, 320, 200)], "everything"), ([(40, 40, 100, 120)], ""),
    ([(40, 40, 90, 100), (200, 40, 260, 90)], "pieces")])
def test_the_verdict_names_what_is_wrong_with_a_mask(boxes, code):
    grey = np.zeros((240, 320), np.uint8)
    for x0, y0, x1, y1 in boxes:
        grey[y0:y1, x0:x1] = 255
    found = findings_of("left", mask_of("left", {"data": cv2.imencode(".png", grey)[1].tobytes()}))
    assert [finding.code for finding in found] == ([code] if code else [])


# -- a node that fails when it should keep something, or bring it back ---------------------------------------------

def both_learnt(nodes):
    """The proposal of a scene and a hand that both nodes have learnt."""
    cameras = {node.name: node.node_id for node in nodes.rig.nodes}
    empty, skin = EmptyStep(cameras), SkinStep(cameras, nodes.connect)
    for step, hand in ((empty, False), (skin, True)):
        nodes.hand = hand
        step.begin()
        step.finish(step.learn(nodes.command))
    skin.accept_observation(skin.observe(dict.fromkeys(cameras)))
    return propose(empty, skin)


def known(nodes):
    return [(store.report(640, 480)["background"], store.path.exists()) for store in nodes.stores.values()]


def test_what_one_node_cannot_keep_no_node_keeps_and_it_can_be_used_again(nodes):
    proposal = both_learnt(nodes)
    nodes.failing = [(2, "save_foreground")]
    with pytest.raises(EngineError, match="node 2 does not answer"):
        use_all(proposal.changes, nodes.command)
    nodes.failing = []
    assert not nodes.stores[1].report(640, 480)["background"]
    use_all(proposal.changes, nodes.command)
    assert known(nodes) == [(True, True), (True, True)]
    restore_all(proposal.changes, nodes.command)
    assert [background for background, _ in known(nodes)] == [False, False]
    use_all(proposal.changes, nodes.command)  # the old one was not better
    assert [background for background, _ in known(nodes)] == [True, True]


def test_a_node_that_cannot_take_it_back_is_named_and_the_others_do(nodes):
    proposal = both_learnt(nodes)
    nodes.failing = [(2, "save_foreground"), (1, "revert_foreground")]
    with pytest.raises(EngineError, match="left still has what was learnt now"):
        use_all(proposal.changes, nodes.command)
    nodes.failing = []
    use_all(proposal.changes, nodes.command)
    nodes.failing = [(1, "revert_foreground")]
    with pytest.raises(EngineError, match="left still has what was learnt now"):
        restore_all(proposal.changes, nodes.command)
    nodes.failing = []
    assert [background for background, _ in known(nodes)] == [True, False]
    restore_all(proposal.changes, nodes.command)
    assert [background for background, _ in known(nodes)] == [False, False]


def test_what_some_nodes_learnt_before_another_failed_is_forgotten_at_the_end(hands, nodes):
    nodes.failing = [(2, "learn_background")]
    hands.click(hands.window.page.learn_button)
    hands.until(lambda: "does not answer" in hands.hint)
    hands.until(lambda: nodes.stores[1].report(640, 480)["background"])
    hands.window.end().wait(PATIENCE_S)
    assert not nodes.stores[1].report(640, 480)["background"]


def test_the_bar_begins_empty_again_when_the_scene_is_learnt_again(nodes):
    step = EmptyStep({"left": 1})
    step.begin()
    step.finish(step.learn(nodes.command))
    step.begin()
    assert step.view().bars[0].fraction == 0.0
