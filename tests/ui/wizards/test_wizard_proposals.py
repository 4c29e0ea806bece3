"""What a wizard proposes and how it is put into force, taken back and remembered; remaining time in words."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import msgspec
import pytest
from fake_engine import synthetic_rig
from wizard_rig import FakeRigClient

from rhot_app import rig_history
from rhot_app.calibration.proposal import NodeChange, Proposal, Row
from rhot_app.calibration.registry import Calibration
from rhot_app.calibration.report import Report
from rhot_app.calibration.verdict import Finding, Grade, judge
from rhot_app.errors import EngineError, RigError
from rhot_app.project import load_rig, save_rig
from rhot_app.ui.models.proposal import RigChange, changes_of, use_all, ways_back
from rhot_app.ui.models.words import Remaining
from rhot_app.ui.wizards.framework.step import AcceptStep, SolveStep, StepView
from rhot_app.ui.wizards.launcher import age_text


@pytest.fixture
def client():
    return FakeRigClient(synthetic_rig())


def test_remaining_time_in_words():
    remaining = Remaining(100.0)
    assert remaining.text(100.1) == ""
    remaining.report(0.25, 110.0)
    assert remaining.text(110.0) == "about 30 s left"
    assert remaining.text(120.0) == "about 20 s left"
    remaining.report(0.3, 220.0)
    assert remaining.text(220.0) == "about 5 min left"
    remaining.report(0.2, 230.0)
    assert remaining.fraction == 0.3


def rig_file(folder):
    path = folder / "desk.json"
    save_rig(path, synthetic_rig("desk"))
    return path


def change_of(path, name):
    before = load_rig(path)
    return RigChange(before, msgspec.structs.replace(before, name=name), path, "lens calibration")


def test_a_rig_change_goes_to_engine_and_file_and_back(client, tmp_path):
    path = rig_file(tmp_path)
    change = change_of(path, "new")
    change.use(client.command)
    assert client.rig.name == "new" and load_rig(path).name == "new"
    assert [v.replaced_by for v in rig_history.versions(path)] == ["lens calibration"]
    change.restore(client.command)
    assert client.rig.name == "desk" and load_rig(path).name == "desk"
    assert len(rig_history.versions(path)) == 2, "the new one can be brought back as well"


def test_a_rig_that_cannot_be_written_is_not_left_in_the_engine(client, tmp_path):
    path = rig_file(tmp_path)
    change = change_of(path, "new")
    gone = RigChange(change.before, change.after, tmp_path / "missing" / "desk.json", "lens calibration")
    with pytest.raises(RigError):
        gone.use(client.command)
    assert client.rig.name == "desk"


def test_a_proposal_is_put_into_force_whole_or_not_at_all(client, tmp_path):
    path = rig_file(tmp_path)

    class Refusing:
        def use(self, command):
            raise EngineError("node left: new settings are not possible.")

        def restore(self, command):
            raise AssertionError("was never used")

        way_back = ""

    with pytest.raises(EngineError):
        use_all((change_of(path, "new"), Refusing()), client.command)
    assert load_rig(path).name == "desk" and client.rig.name == "desk"


def test_a_proposal_changes_the_rig_and_what_it_names(tmp_path):
    path, node = rig_file(tmp_path), NodeChange(2, {"camera": {"gain": None}}, {"camera": {"gain": 2.5}})
    rig = load_rig(path)
    new = msgspec.structs.replace(rig, name="new")
    proposal = Proposal("lens calibration", judge("rms 0.3 px", []), (), rig, new, (node,))
    assert changes_of(proposal, path) == (node, RigChange(rig, new, path, "lens calibration"))
    assert proposal.save(path) == str(path) and load_rig(path).name == "new"
    assert changes_of(Proposal("camera settings", judge("good", []), (), changes=(node,)), path) == (node,)


def test_a_node_change_goes_to_the_node_and_back(client):
    change = NodeChange(2, {"camera": {"gain": None}}, {"camera": {"gain": 2.5}})
    change.use(client.command)
    assert client.settings[2].camera.gain == 2.5 and client.settings[1].camera.gain is None
    change.restore(client.command)
    assert client.settings[2].camera.gain is None


def test_only_what_a_rigs_file_keeps_is_said_to_come_back_at_any_time(tmp_path):
    change = change_of(rig_file(tmp_path), "new")
    node = NodeChange(2, {"camera": {"gain": None}}, {"camera": {"gain": 2.5}})

    assert "any time" in ways_back((change,)) and ways_back((change, change)) == ways_back((change,))
    assert "any time" in ways_back((change, node)) and "until this window closes" in ways_back((change, node))
    unsaved = [RigChange(change.before, change.after, path, "calibration") for path in (None, tmp_path / "gone.json")]
    for nothing_kept in ((), (node,), *((one,) for one in unsaved)):
        assert "any time" not in ways_back(nothing_kept)


@pytest.mark.parametrize("grade", list(Grade))
def test_no_step_is_done_or_says_next_beside_a_verdict_that_forbids(grade):
    verdict = judge("rms 9 px", [Finding("rms", grade, "rms 9 px")])
    view = StepView("Enough: press Next.", done=True, verdict=verdict)
    assert view.done == view.may_go_on == ("Next" in view.sentence) == verdict.acceptable
    sample = Calibration("sample", "Sample", "", "sample", report=lambda result, now: Report(verdict))
    solve = SolveStep(sample, None, lambda: None, "…")
    solve.take_result(object())
    assert solve.view().done == ("go on" in solve.view().sentence) == verdict.acceptable


def test_the_last_step_refuses_a_poor_result_and_comes_back(client):
    poor = judge("rms 9 px", [Finding("rms", Grade.POOR, "rms 9 px", "The board moved.", "Hold it still.")])
    step = AcceptStep(lambda: Proposal("lens calibration", poor, (Row("rms", "0.3 px", "9 px"),)), None)
    step.enter()
    assert not step.usable and "must not be used" in step.view().sentence
    step = AcceptStep(lambda: Proposal("lens calibration", judge("rms 0.3 px", []), ()), None)
    step.enter()
    assert step.usable and step.keeps and not step.view().done
    step.begin()
    step.finish("used")
    assert step.view().done and step.restorable and not step.keeps
    step.finish("restored")
    assert step.usable and not step.keeps


def test_what_is_in_force_follows_restores(tmp_path):
    path = rig_file(tmp_path)
    assert rig_history.in_force(path) == {}
    one = msgspec.structs.replace(load_rig(path), name="one")
    rig_history.accept(path, one, "lens calibration")
    rig_history.accept(path, msgspec.structs.replace(one, name="two"), "stereo calibration")
    assert set(rig_history.in_force(path)) == {"lens calibration", "stereo calibration"}
    before_stereo = rig_history.versions(path)[0]
    rig_history.restore(path, before_stereo)
    assert set(rig_history.in_force(path)) == {"lens calibration"}
    rig_history.restore(path, rig_history.versions(path)[0])
    assert set(rig_history.in_force(path)) == {"lens calibration", "stereo calibration"}


def test_age_in_words():
    now = datetime(2026, 5, 10, 12, 0, tzinfo=UTC)
    texts = [age_text(now - timedelta(days=days), now) for days in (0, 1, 5, 100)]
    assert texts == ["today", "yesterday", "5 days ago", "3 months ago"]
