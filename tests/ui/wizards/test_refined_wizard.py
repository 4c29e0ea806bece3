"""What the engine learns from a moving hand, in the window: the refined calibration, the adapted hand, measured bones.

All are shown before and after, used only when asked, and kept with the way back.
"""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from fake_engine import synthetic_rig
from knocked_rig import moved
from wizard_hands import Hands
from wizard_rig import FakeRigClient, RigBackend

from rhot_app.calibration.kinds.tracked import MEASURED, REFINED, propose_hand, propose_poses
from rhot_app.calibration.registry import InForce
from rhot_app.calibration.verdict import Finding, Grade, judge
from rhot_app.engine.status import Advice
from rhot_app.project import load_rig
from rhot_app.rig_history import versions
from rhot_app.ui.status_words import _advice_notice
from rhot_app.ui.wizards.framework.definition import OPEN_WIZARD
from rhot_app.ui.wizards.framework.while_tracking import EngineFeed, MoveStep, ask_engine


class RefiningClient(FakeRigClient):
    """An engine that answers `refined` as it is told."""

    answer: dict

    def command(self, name, timeout_s=5.0, **arguments):
        known = name in ("refined", "adapted", "measured")
        return self.answer if known else super().command(name, timeout_s=timeout_s, **arguments)


def answer_of(rig, *, grade=Grade.GOOD, stale=True):
    pose = moved(rig.nodes[1].pose, np.radians([0.3, 0.0, 0.0, 0.0, 0.0, 0.0]))
    after = msgspec.structs.replace(rig, nodes=(rig.nodes[0], msgspec.structs.replace(rig.nodes[1], pose=pose)))
    verdict = judge("rays miss each other by 0.02 px instead of 1.40.", [Finding("moved", grade, "It has turned.")])
    return {"known": True, "stale": stale, "usable": stale and verdict.acceptable, **verdict.to_json(),
            "rows": [["rays miss each other by", "1.40 px", "0.02 px"]], "document": msgspec.to_builtins(after)}


def hand_answer(rig, grade=Grade.GOOD):
    thicker = msgspec.structs.replace(rig.hand.fingers["index"], radii_mm=(9.0, 8.0, 7.0))
    hand = msgspec.structs.replace(rig.hand, fingers={**rig.hand.fingers, "index": thicker})
    verdict = judge("by 24 poses.", [Finding("adapted", grade, "Radii change by 2 %.")])
    return {"known": True, **verdict.to_json(), "rows": [["index radii", "8.5 mm", "9.0 ± 0.2 mm"]],
            "document": msgspec.to_builtins(msgspec.structs.replace(rig, hand=hand))}


@pytest.fixture(params=["refined"])
def hands(open_wizard, request):
    client = RefiningClient(synthetic_rig())
    client.answer = {"known": False}
    return open_wizard(request.param, client, make=lambda context: ask_engine(
        context, context.calibration.collect[0], ask_s=0.02))


def test_it_is_used_only_when_asked_and_can_be_taken_back(hands):
    assert not hands.frame.next_button.isEnabled()
    hands.client.answer = answer_of(hands.rig)
    hands.next()
    assert load_rig(hands.path) == hands.rig, "nothing was changed yet"
    hands.use()
    assert load_rig(hands.path).nodes[1].pose != hands.rig.nodes[1].pose
    assert [one.replaced_by for one in versions(hands.path)] == ["refined calibration"]
    hands.restore()
    assert load_rig(hands.path) == hands.rig


@pytest.mark.parametrize(("stale", "grade"), [(False, Grade.GOOD), (True, Grade.POOR)])
def test_what_holds_or_is_not_determined_leads_nowhere(stale, grade):
    client = RefiningClient(synthetic_rig())
    feed = EngineFeed(client.connect, "refined")
    step = MoveStep(REFINED.collect[0], feed)
    client.answer = answer_of(client.rig, stale=stale, grade=grade)
    feed.step(client)
    view = step.view()
    assert ("holds" if not stale else "Go on") in view.sentence and not view.may_go_on


def test_only_poses_are_proposed():
    rig = synthetic_rig()
    edited = msgspec.structs.replace(rig, name="edited since")
    proposal = propose_poses(answer_of(rig), InForce(edited))
    assert proposal is not None and proposal.rig is not None
    assert proposal.rig.name == "edited since" and proposal.rows[0].after == "0.02 px"
    assert propose_poses({"known": False}, InForce(rig)) is None
    assert propose_poses(answer_of(rig, stale=False), InForce(rig)) is None


def test_the_engines_sentence_has_the_button():
    notice = _advice_notice(Advice("warning", "The right camera has turned.", "refined"))
    assert notice.action == "Use refined calibration …" and notice.key == f"{OPEN_WIZARD}refined"


@pytest.mark.parametrize(("hands", "reason"), [("adapted", "hand adapted while it was tracked"),
                                               ("measured", "bones measured while the hand was tracked")],
                         indirect=["hands"])
def test_a_learnt_hand_is_used_only_when_asked(hands, reason):
    assert not hands.frame.next_button.isEnabled()
    hands.client.answer = hand_answer(hands.rig)
    hands.next()
    assert load_rig(hands.path) == hands.rig, "nothing was changed yet"
    hands.use()
    assert load_rig(hands.path).hand.fingers["index"].radii_mm == (9.0, 8.0, 7.0)
    assert [one.replaced_by for one in versions(hands.path)] == [reason]
    hands.restore()
    assert load_rig(hands.path) == hands.rig


def test_only_the_hand_is_proposed():
    rig = synthetic_rig()
    edited = msgspec.structs.replace(rig, name="edited since")
    proposal = propose_hand(hand_answer(rig), InForce(edited), "by contours")
    assert proposal is not None and proposal.rig is not None
    assert proposal.rig.name == "edited since" and proposal.rig.nodes == rig.nodes and proposal.rig.hand != rig.hand
    assert propose_hand({"known": False}, InForce(rig), "by contours") is None


def test_bones_that_must_not_be_used_lead_nowhere():
    client = RefiningClient(synthetic_rig())
    feed = EngineFeed(client.connect, "measured")
    step = MoveStep(MEASURED.collect[0], feed)
    client.answer = hand_answer(client.rig, Grade.POOR)
    feed.step(client)
    view = step.view()
    assert not view.may_go_on and not view.verdict.acceptable and "two cameras" in view.sentence


def test_the_offer_of_measured_bones_is_clicked_and_used(make_bench, tmp_path):
    bench = make_bench(RigBackend(tmp_path / "desk.json"))
    bench.track()
    rig, client, window = bench.controller.rig, bench.backend.rig_client, bench.window
    client.answers["measured"] = hand_answer(rig)
    bench.backend.engine.advice = (Advice("info", "The bones differ by 4 mm.", "measured", subject="information"),)
    bench.until(lambda: "Use measured bones …" in window.advice.buttons)
    bench.click(window.advice.buttons["Use measured bones …"])
    bench.until(lambda: window.wizards.wizard is not None)
    wizard = Hands(window.wizards.wizard)
    wizard.next()
    wizard.use()
    assert load_rig(tmp_path / "desk.json").hand.fingers["index"].radii_mm == (9.0, 8.0, 7.0)
