"""A hand that the engine has learnt while it tracked, without its widgets: adapted to contours, or measured by
landmarks."""

from __future__ import annotations

from pathlib import Path

import msgspec

from rhot_app.project import Rig, parse_rig
from rhot_app.ui.models.proposal import Proposal, RigChange, Row
from rhot_app.ui.wizards.models.step import StepView
from rhot_app.ui.wizards.steps.refined_steps import ASK_S, Answer, MakeProposal, MoveStep, verdict_from


class ShowHandStep(MoveStep):
    """Shows how well the tracked hand is known by now."""

    title = "Show the hand"

    def _sentence(self) -> str:
        return "Start the tracking of a bare hand by its contours. Spread and bend every finger, and turn the hand."

    def view(self) -> StepView:
        """What to do, until the hand may be used."""
        if not self.answer["known"]:
            return StepView(self._sentence() if self._clock() - self._begun_s > ASK_S else "One moment.",
                            hint=self._feed.problem)
        verdict = verdict_from(self.answer)
        if not verdict.acceptable:
            return StepView(self._sentence(), verdict=verdict, hint=self._feed.problem or "It cannot be used as it is.")
        return StepView("Go on moving for a better result, or look at it.", done=True, verdict=verdict,
                        hint=self._feed.problem)


class ShowBonesStep(ShowHandStep):
    """Shows how well the bones of the tracked hand are known by now."""

    def _sentence(self) -> str:
        return "Start the tracking by landmarks. Show the open hand to two cameras for some seconds, and turn it."


def propose_hand(reason: str) -> MakeProposal:
    """Makes of an answer the rig with its hand; None while there is none. `reason`: for the rig's history."""
    def propose(answer: Answer, rig: Rig, path: Path | None) -> Proposal | None:
        if not answer.get("known"):
            return None
        after = parse_rig(msgspec.json.encode(answer["document"]), "the rig with the other hand")
        changed = msgspec.structs.replace(rig, hand=after.hand)  # nothing else: the rig may have been edited meanwhile
        rows = tuple(Row(what, before, now) for what, before, now in answer["rows"])
        return Proposal(reason, verdict_from(answer), rows, (RigChange(rig, changed, path, reason),))
    return propose
