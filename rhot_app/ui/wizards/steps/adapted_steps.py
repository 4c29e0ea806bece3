"""The adapted hand without its widgets: what the engine has learnt of a bare hand's shape, and what it proposes."""

from __future__ import annotations

from pathlib import Path

import msgspec

from rhot_app.handfit.adaptation import REASON
from rhot_app.project import Rig, parse_rig
from rhot_app.ui.models.proposal import Proposal, RigChange, Row
from rhot_app.ui.wizards.models.step import StepView
from rhot_app.ui.wizards.steps.refined_steps import ASK_S, Answer, MoveStep, verdict_from


class ShowHandStep(MoveStep):
    """Shows how well the tracked hand's shape is known by now."""

    title = "Show the hand"

    def view(self) -> StepView:
        """What to do, until the adapted hand may be used."""
        if not self.answer["known"]:
            sentence = ("Start the tracking of a bare hand by its contours. Spread and bend every finger, and turn the "
                        "hand.")
            return StepView(sentence if self._clock() - self._begun_s > ASK_S else "One moment.",
                            hint=self._feed.problem)
        return StepView("Go on moving for a better result, or look at it.", done=True,
                        verdict=verdict_from(self.answer), hint=self._feed.problem)


def propose(answer: Answer, rig: Rig, path: Path | None) -> Proposal | None:
    """The rig with the adapted hand; None while there is none."""
    if not answer.get("known"):
        return None
    after = parse_rig(msgspec.json.encode(answer["document"]), "the rig with the adapted hand")
    adapted = msgspec.structs.replace(rig, hand=after.hand)  # nothing else: the rig may have been edited meanwhile
    rows = tuple(Row(what, before, now) for what, before, now in answer["rows"])
    return Proposal(REASON, verdict_from(answer), rows, (RigChange(rig, adapted, path, REASON),))
