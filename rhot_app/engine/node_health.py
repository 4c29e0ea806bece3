"""What nodes say of their machines - heat, supply voltage, memory - as advice to the operator. Pure.

A node's answer is another program's: whatever is not as docs/node.md describes it is passed over.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Mapping
from typing import Any, Literal

import msgspec

from rhot_app.engine.status import Advice
from rhot_node.errors import printable
from rhot_node.health.checks import BLACK_PICTURE

SENTENCE_MAX = 300  # characters
_TOLD_MAX = 8  # per node


class _Trouble(msgspec.Struct):
    """One thing that a node complains of; what else it says is not needed."""

    level: Literal["warning", "error"]
    text: str
    remedy: str = ""
    code: str = ""


def health_advice(name: str, state: Mapping[str, Any]) -> tuple[Advice, ...]:
    """The sentences of node `name`, by the `health` of its answer to a state request. A black picture is left out:
    `sees_black` tells of it, and the engine says it instead of what the camera does not see."""
    found = []
    for trouble in _troubles(state):
        if trouble.code == BLACK_PICTURE.code:
            continue
        sentence = printable(f"{trouble.text} {trouble.remedy}".rstrip())[:SENTENCE_MAX]
        found.append(Advice(trouble.level, f"Node {name}: {sentence[:1].lower()}{sentence[1:]}"))
    return tuple(found)


def sees_black(state: Mapping[str, Any]) -> bool:
    """Whether a node says that its camera's picture is black."""
    return any(trouble.code == BLACK_PICTURE.code for trouble in _troubles(state))


def _troubles(state: Mapping[str, Any]) -> list[_Trouble]:
    """What can be read of the `health` of a node's answer."""
    told = state.get("health")
    found = []
    for item in told[:_TOLD_MAX] if isinstance(told, list) else ():
        with contextlib.suppress(msgspec.ValidationError):
            found.append(msgspec.convert(item, _Trouble))
    return found


def most_urgent_first(advice: Iterable[Advice]) -> tuple[Advice, ...]:
    """Errors, then warnings, then the rest, otherwise in their order."""
    order = ("error", "warning", "info")
    return tuple(sorted(advice, key=lambda one: order.index(one.level)))
