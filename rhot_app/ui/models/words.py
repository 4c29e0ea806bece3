"""Which word, shape and tone each state has. Colour is never alone: every state also has its own shape.

Shapes are names that `rhot_app.ui.shapes` draws; tones are names of `palette.Scheme` colours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rhot_app.tracking.state import Condition, HandState, Knowledge
from rhot_node.wire.messages import MarkerFlag


@dataclass(frozen=True, slots=True)
class Look:
    """How a state is shown: a word, a shape, a tone, and a sentence that explains it."""

    word: str
    shape: str
    tone: str
    meaning: str


CONDITIONS: dict[str, Look] = {
    Condition.IDLE.value: Look("IDLE", "square", "neutral", "Nothing is running. Press Start to begin."),
    Condition.SEARCHING.value: Look("SEARCHING", "ring", "accent",
                                    "The nodes stream, but the hand has not been found yet."),
    Condition.TRACKING.value: Look("TRACKING", "disc", "good", "The hand is tracked and every marker is seen."),
    Condition.PARTIAL.value: Look("PARTIAL", "half", "caution",
                                  "The hand is tracked, but some markers are not seen by enough cameras."),
    Condition.LOST.value: Look("LOST", "cross", "bad", "The hand was tracked and is out of sight now."),
    Condition.FAULT.value: Look("FAULT", "octagon", "fault", "Something is broken; the sentence below says what."),
}

NO_RIG = Look("NO RIG", "square", "neutral", "No rig is open. Choose one to begin.")
STARTING = Look("STARTING", "ring", "accent", "The engine is starting.")
NO_ENGINE = Look("NO ENGINE", "octagon", "fault", "The engine does not answer. The app is starting it again.")

NODES: dict[str, Look] = {
    "silent": Look("silent", "cross", "bad", "Nothing has been heard from this node for a second."),
    "starting": Look("starting", "ring", "accent", "The node is opening its camera."),
    "ready": Look("ready", "square", "neutral", "The node waits for the start message."),
    "streaming": Look("streaming", "disc", "good", "The node sends what it sees."),
    "fault": Look("fault", "octagon", "fault", "The node reports that something is broken."),
}

KNOWLEDGE: dict[Knowledge, Look] = {
    Knowledge.MEASURED: Look("measured", "disc", "good", "Seen by enough cameras at this instant. Drawn solid."),
    Knowledge.INFERRED: Look("inferred", "half", "caution",
                             "Follows from what is measured through the hand model, or from a half-hidden sight. "
                             "Drawn translucent."),
    Knowledge.GUESSED: Look("guessed", "hatch", "neutral",
                            "The images do not determine it: the last or the most natural value. Drawn hatched."),
    Knowledge.UNKNOWN: Look("unknown", "cross", "bad", "Nothing is known. Not drawn."),
}

STAGES: dict[str, str] = {
    "detect": "detect", "network": "network", "pair": "pair", "triangulate": "triangulate", "filter": "filter",
    "solve": "solve", "publish": "publish", "receive_to_state": "receive to state",
}

OK = Look("ok", "disc", "good", "Seen by every camera.")
HIDDEN = Look("half hidden", "half", "caution", "A camera sees only a part of it; its place is less certain.")
AMBIGUOUS = Look("ambiguous", "half", "caution", "Another spot of the same colour is as plausible.")
MARKER_LOST = Look("lost", "cross", "bad", "No camera sees it.")


def condition_look(condition: str) -> Look:
    """Look of a `Condition` value; an unknown word is shown as it is, as a fault."""
    return CONDITIONS.get(condition, Look(condition, "octagon", "fault", "This state is not known to this version."))


def marker_look(state: HandState, marker: int) -> Look:
    """State of one marker in words: which camera misses it, or what is wrong with the sight of it."""
    flags = state.camera_flags[:, marker]
    seen = (flags & int(MarkerFlag.LOST)) == 0
    seen &= np.isfinite(state.camera_pixels[:, marker, 0])
    if not seen.any():
        return MARKER_LOST
    if not seen.all():
        names = [name for name, has in zip(state.camera_names, seen, strict=True) if has]
        return Look(f"{', '.join(names)} only", "half", "caution",
                    "Not every camera sees it, so its depth is not measured.")
    union = int(np.bitwise_or.reduce(flags))
    if union & int(MarkerFlag.AMBIGUOUS):
        return AMBIGUOUS
    return HIDDEN if union & int(MarkerFlag.PARTIAL) else OK
