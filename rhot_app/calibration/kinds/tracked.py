"""What the engine finds of itself while it tracks: refined poses of the cameras, an adapted hand, measured bones.

Nothing is solved here: the engine's answers to `refined`, `adapted` and `measured` are proposed.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from rhot_app.calibration.collect import Answer, Said, WhileTracking
from rhot_app.calibration.registry import Calibration, InForce
from rhot_app.calibration.verdict import Verdict, verdict_from

if TYPE_CHECKING:
    from rhot_app.calibration.proposal import Proposal, Row
    from rhot_app.project import Rig


def propose_poses(answer: Answer, now: InForce) -> Proposal | None:
    """The rig with refined poses; None while there is nothing that may be used."""
    import msgspec

    from rhot_app.calibration.proposal import Proposal, rows_of

    if not answer.get("known") or not answer["stale"]:
        return None
    rig, after = now.rig, _document(answer)
    # Nothing but poses: the rig may have been edited since the engine was asked.
    nodes = tuple(msgspec.structs.replace(node, pose=refined.pose) for node, refined
                  in zip(rig.nodes, after.nodes, strict=True))
    refined = msgspec.structs.replace(rig, nodes=nodes, calibration=after.calibration)
    return Proposal(REFINED.reason, verdict_from(answer), (*_rows(answer), *rows_of(rig, refined)), rig, refined)


def propose_hand(answer: Answer, now: InForce, reason: str) -> Proposal | None:
    """The rig with the answer's hand; None while there is none. `reason`: for the rig's history."""
    import msgspec

    from rhot_app.calibration.proposal import Proposal

    if not answer.get("known"):
        return None
    # Nothing but the hand: the rig may have been edited meanwhile.
    changed = msgspec.structs.replace(now.rig, hand=_document(answer).hand)
    return Proposal(reason, verdict_from(answer), _rows(answer), now.rig, changed)


def _document(answer: Answer) -> Rig:
    import msgspec

    from rhot_app.project import parse_rig

    return parse_rig(msgspec.json.encode(answer["document"]), "the engine's rig")


def _rows(answer: Answer) -> tuple[Row, ...]:
    from rhot_app.calibration.proposal import Row

    return tuple(Row(what, before, now) for what, before, now in answer["rows"])


# -- what is said meanwhile --------------------------------------------------------------------------------------------

GO_ON = "Go on moving for a better result, or look at it."


def say_poses(answer: Answer, verdict: Verdict) -> Said:
    """Whether the calibration in force still holds, and whether the movement determines another."""
    if not answer["stale"]:
        return Said("The calibration in force still holds: there is nothing to do." if verdict.acceptable else
                    "No better calibration was found.")
    if not answer["usable"]:
        return Said("Go on: move the hand through both pictures, near and far.",
                    "The movement does not yet determine all of it.")
    return Said(GO_ON, done=True)


def _hand(name: str, title: str, meaning: str, reason: str, sentence: str, nothing: str) -> Calibration:
    """A hand that the engine's command `name` gives; `sentence` says how to show it."""
    def say(answer: Answer, verdict: Verdict) -> Said:
        return Said(GO_ON, done=True) if verdict.acceptable else Said(sentence, "It cannot be used as it is.")

    return Calibration(name, title, meaning, reason,
                       collect=(WhileTracking(name, "Show the hand", sentence, say, nothing),),
                       propose=lambda answer, now: propose_hand(answer, now, reason))


REFINED = Calibration(
    "refined", "Use refined calibration", "How the cameras stand now, from the hand that moves while it is tracked.",
    "refined calibration", collect=(WhileTracking(
        "refined", "Move the hand", "Start the tracking and move the hand through both pictures, near and far.",
        say_poses, "The calibration in force still holds, or too little of the hand was seen."),),
    propose=propose_poses)
ADAPTED = _hand(
    "adapted", "Adapt the hand's shape", "How long and how thick the fingers are, from a bare hand that moves while it "
    "is tracked.", "hand adapted while it was tracked",
    "Start the tracking of a bare hand by its contours. Spread and bend every finger, and turn the hand.",
    "Too little of the hand was seen.")
MEASURED = _hand(
    "measured", "Use measured bones", "How long the bones are, from the landmarks of a hand that two cameras see while "
    "it is tracked.", "bones measured while the hand was tracked",
    "Start the tracking by landmarks. Show the open hand to two cameras for some seconds, and turn it.",
    "Two cameras have not yet seen enough of the hand.")
