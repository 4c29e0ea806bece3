"""What the engine has found while it tracked, as proposals: refined poses of the cameras, or another hand.

An answer of the engine's commands `refined`, `adapted` and `measured` has `known`, `document` (the rig), `rows` and the
fields of a verdict.
"""

from __future__ import annotations

from typing import Any

import msgspec

from rhot_app.calibration.proposal import Proposal, Row, rows_of
from rhot_app.calibration.registry import REFINED
from rhot_app.calibration.verdict import Finding, Grade, Verdict
from rhot_app.errors import EngineError
from rhot_app.project import Rig, parse_rig

Answer = dict[str, Any]


def verdict_from(answer: Answer) -> Verdict:
    """The verdict in an engine's answer. Raises EngineError when it is of another version."""
    try:
        findings = tuple(Finding(one["code"], Grade(one["grade"]), one["figure"], one["cause"], one["remedy"])
                         for one in answer["findings"])
        return Verdict(answer["verdict"], findings)
    except (KeyError, TypeError, ValueError) as exc:
        raise EngineError(f"the engine's answer cannot be read ({exc}); is it of another version? Restart "
                          "engine and app.") from exc


def propose_poses(answer: Answer, rig: Rig) -> Proposal | None:
    """The rig with refined poses; None while there is nothing that may be used."""
    if not answer.get("known") or not answer["stale"]:
        return None
    after = parse_rig(msgspec.json.encode(answer["document"]), "the refined rig")
    # Nothing but poses: the rig may have been edited since the engine was asked.
    nodes = tuple(msgspec.structs.replace(node, pose=refined.pose) for node, refined
                  in zip(rig.nodes, after.nodes, strict=True))
    refined = msgspec.structs.replace(rig, nodes=nodes, calibration=after.calibration)
    return Proposal(REFINED.reason, verdict_from(answer), (*_rows(answer), *rows_of(rig, refined)), rig, refined)


def propose_hand(answer: Answer, rig: Rig, reason: str) -> Proposal | None:
    """The rig with the answer's hand; None while there is none. `reason`: for the rig's history."""
    if not answer.get("known"):
        return None
    after = parse_rig(msgspec.json.encode(answer["document"]), "the rig with the other hand")
    changed = msgspec.structs.replace(rig, hand=after.hand)  # nothing else: the rig may have been edited meanwhile
    return Proposal(reason, verdict_from(answer), _rows(answer), rig, changed)


def _rows(answer: Answer) -> tuple[Row, ...]:
    return tuple(Row(what, before, now) for what, before, now in answer["rows"])
