"""What nodes say of their machines - heat, supply voltage, memory - as advice to the operator. Pure.

A node's answer is another program's: whatever is not as docs/node.md describes it is passed over.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal

import msgspec

from rhot_app.engine.status import Advice
from rhot_node.errors import printable

SENTENCE_MAX = 300  # characters
_TOLD_MAX = 8  # per node


class _Trouble(msgspec.Struct):
    """One thing that a node complains of; what else it says is not needed."""

    level: Literal["warning", "error"]
    text: str
    remedy: str = ""


def health_advice(name: str, state: Mapping[str, Any]) -> tuple[Advice, ...]:
    """The sentences of node `name`, by the `health` of its answer to a state request."""
    told = state.get("health")
    if not isinstance(told, list):
        return ()
    found = []
    for item in told[:_TOLD_MAX]:
        try:
            trouble = msgspec.convert(item, _Trouble)
        except msgspec.ValidationError:
            continue
        sentence = printable(f"{trouble.text} {trouble.remedy}".rstrip())[:SENTENCE_MAX]
        found.append(Advice(trouble.level, f"Node {name}: {sentence[:1].lower()}{sentence[1:]}"))
    return tuple(found)


def most_urgent_first(advice: Iterable[Advice]) -> tuple[Advice, ...]:
    """Errors, then warnings, then the rest, otherwise in their order."""
    order = ("error", "warning", "info")
    return tuple(sorted(advice, key=lambda one: order.index(one.level)))
