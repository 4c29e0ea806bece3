"""Names are the field's terms: modules and public identifiers without the retired words of the style guide."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("rhot_node", "rhot_app")

RETIRED = frozenset((
    "sight", "habits", "strangeness", "surprise", "agitation", "liveliness", "hiding", "outfit", "withholding",
    "forgetting", "reappearing", "share", "desk", "slots", "lean", "company", "whereabouts", "litter", "strays",
    "warmth", "door", "tap", "admission", "act", "stage", "prop", "stations", "spans", "moments", "honesty", "honest",
    "alterations", "takes", "trial", "disagreement", "misfits", "voice", "teller", "passing", "looker", "theatre",
    "clothes", "moods", "doubts", "coach"))
"""Words of our own for what has a name: pose prior, gate, robust weight, occlusion, workspace, illuminant, validator,
record sink, authentication, scene object, rigid target, board poses, exposure samples, consistency, fault injection,
data set, run, outlier."""

ALLOWED = frozenset((
    "blind_share", "room_share", "share", "share_out", "measured_share", "known_share", "MARKER_SHARE",
    "share_interpreter",  # of processor time
    "moments",  # of a distribution
    "STAGE_COLOURS", "LATENCY_STAGES", "stages", "choose_stage", "spans_plane",  # of a pipeline
    "passing_px"))
"""Names in which such a word has its ordinary sense."""


@cache
def is_retired(name: str) -> bool:
    """Whether a part of a snake_case or CamelCase name is retired, and the name is not allowed."""
    parts = {part.lower() for part in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)}
    return not parts.isdisjoint(RETIRED) and name not in ALLOWED


def retired_names() -> Iterator[str]:
    """Modules, public classes, functions and fields whose names have a retired word, with their places."""
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            where, text = str(path.relative_to(ROOT)), path.read_text()
            if is_retired(path.stem):
                yield where
            suspect = any(map(is_retired, re.findall(r"\w+(?= *[:(])", text)))
            for node in ast.walk(ast.parse(text)) if suspect else ():  # parsing takes long
                if isinstance(node, ast.ClassDef | ast.FunctionDef):
                    name = node.name
                elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
                    name = node.target.id
                else:
                    continue
                if is_retired(name) and not name.startswith("_"):
                    yield f"{where}:{node.lineno} {name}"


def test_no_module_and_no_public_name_has_a_retired_word() -> None:
    found = list(retired_names())
    assert not found, "names with retired words:\n" + "\n".join(found)
