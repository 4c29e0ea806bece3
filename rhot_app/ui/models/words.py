"""The words of the app: states, tooltips, hands, motions, trackers, remaining time, grades.

Every state has a word, a shape and a tone. Colour is never alone: every state also has its own shape.

Shapes are names that `rhot_app.ui.common.shapes` draws; tones are names of `palette.Scheme` colours.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from rhot_app.calibration.verdict import Grade
from rhot_app.hand.anthropometry import hand_length
from rhot_app.project import Rig
from rhot_app.state import Condition, HandState, Knowledge
from rhot_app.ui.language import tr, tr_noop
from rhot_node.wire.messages import MarkerFlag


@dataclass(frozen=True, slots=True)
class Look:
    """How a state is shown: a word, a shape, a tone, and a sentence that explains it."""

    word: str
    shape: str
    tone: str
    meaning: str


CONDITIONS: dict[str, Look] = {
    Condition.IDLE.value: Look(tr_noop("IDLE"), "square", "neutral",
                               tr_noop("Nothing is running. Press Start to begin.")),
    Condition.SEARCHING.value: Look(tr_noop("SEARCHING"), "ring", "accent",
                                    tr_noop("The nodes stream, but the hand has not been found yet.")),
    Condition.TRACKING.value: Look(tr_noop("TRACKING"), "disc", "good",
                                   tr_noop("The hand is tracked, and its markers, landmarks or contours are seen by "
                                           "enough cameras.")),
    Condition.PARTIAL.value: Look(tr_noop("PARTIAL"), "half", "caution",
                                  tr_noop("The hand is tracked, but some of its markers, landmarks or contours are not "
                                          "seen by enough cameras.")),
    Condition.LOST.value: Look(tr_noop("LOST"), "cross", "bad",
                               tr_noop("The hand was tracked and is out of sight now.")),
    Condition.FAULT.value: Look(tr_noop("FAULT"), "octagon", "fault",
                                tr_noop("Something is broken; the sentence below says what.")),
}

NO_RIG = Look(tr_noop("NO RIG"), "square", "neutral", tr_noop("No rig is open. Choose one to begin."))
STARTING = Look(tr_noop("STARTING"), "ring", "accent", tr_noop("The engine is starting."))
NO_ENGINE = Look(tr_noop("NO ENGINE"), "octagon", "fault",
                 tr_noop("The engine does not answer. The app is starting it again."))

UNKNOWN_STATE = tr_noop("This state is not known to this version.")

NODES: dict[str, Look] = {
    "silent": Look(tr_noop("silent"), "cross", "bad", tr_noop("Nothing has been heard from this node for a second.")),
    "starting": Look(tr_noop("starting"), "ring", "accent", tr_noop("The node is opening its camera.")),
    "ready": Look(tr_noop("ready"), "square", "neutral", tr_noop("The node waits for the start message.")),
    "streaming": Look(tr_noop("streaming"), "disc", "good", tr_noop("The node sends what it sees.")),
    "fault": Look(tr_noop("fault"), "octagon", "fault", tr_noop("The node reports that something is broken.")),
}

KNOWLEDGE: dict[Knowledge, Look] = {
    Knowledge.MEASURED: Look(tr_noop("measured"), "disc", "good",
                             tr_noop("Seen by enough cameras at this instant. Drawn solid.")),
    Knowledge.INFERRED: Look(tr_noop("inferred"), "half", "caution",
                             tr_noop("Follows from what is measured through the hand model, or from a half-hidden "
                                     "sight. Drawn translucent.")),
    Knowledge.GUESSED: Look(tr_noop("guessed"), "hatch", "neutral",
                            tr_noop("The images do not determine it: the last or the most natural value. Drawn "
                                    "hatched.")),
    Knowledge.UNKNOWN: Look(tr_noop("unknown"), "cross", "bad", tr_noop("Nothing is known. Not drawn.")),
}

STAGES: dict[str, str] = {
    "detect": tr_noop("detect"), "network": tr_noop("network"), "pair": tr_noop("pair"),
    "triangulate": tr_noop("triangulate"), "filter": tr_noop("filter"),
    "solve": tr_noop("solve"), "publish": tr_noop("publish"), "receive_to_state": tr_noop("receive to state"),
}

OK = Look(tr_noop("ok"), "disc", "good", tr_noop("Seen by every camera."))
HIDDEN = Look(tr_noop("half hidden"), "half", "caution",
              tr_noop("A camera sees only a part of it; its place is less certain."))
AMBIGUOUS = Look(tr_noop("ambiguous"), "half", "caution", tr_noop("Another spot of the same colour is as plausible."))
MARKER_LOST = Look(tr_noop("lost"), "cross", "bad", tr_noop("No camera sees it."))


def condition_look(condition: str) -> Look:
    """Look of a `Condition` value; an unknown word is shown as it is, as a fault."""
    return CONDITIONS.get(condition, Look(condition, "octagon", "fault", UNKNOWN_STATE))


def marker_look(state: HandState, marker: int) -> Look:
    """State of one marker in words: which camera misses it, or what is wrong with its observation."""
    flags = state.camera_flags[:, marker]
    seen = (flags & int(MarkerFlag.LOST)) == 0
    seen &= np.isfinite(state.camera_pixels[:, marker, 0])
    if not seen.any():
        return MARKER_LOST
    if not seen.all():
        names = [name for name, has in zip(state.camera_names, seen, strict=True) if has]
        return Look(tr("{names} only", names=", ".join(names)), "half", "caution",
                    tr_noop("Not every camera sees it, so its depth is not measured."))
    union = int(np.bitwise_or.reduce(flags))
    if union & int(MarkerFlag.AMBIGUOUS):
        return AMBIGUOUS
    return HIDDEN if union & int(MarkerFlag.PARTIAL) else OK


# -- tooltips ----------------------------------------------------------------------------------------------------------

TERMS: dict[str, str] = {
    "condition": tr_noop("The state of the whole rig in one word: IDLE, SEARCHING, TRACKING, PARTIAL, LOST or FAULT."),
    "state rate": tr_noop("How many hand states per second the engine publishes."),
    "rig": tr_noop("The rig file: cameras, lenses, marker set, hand and filters."),
    "node": tr_noop("A small computer with a camera. It finds the markers in its picture and sends their places."),
    "node rate": tr_noop("Frames per second that arrive from this node."),
    "lost": tr_noop("Frames that were not used since the start, shown when they are more than one in a hundred. The "
                    "hint of the card says why."),
    "dropped": tr_noop("Datagrams that arrived and were rejected, with the reason."),
    "clock": tr_noop("How well the node's clock is known: the true offset lies within this bound of the estimate. 1 ms "
                     "at 1 m/s is 1 mm."),
    "marker": tr_noop("A coloured spot on the hand: five painted fingertips and a wrist band."),
    "jitter": tr_noop("How much a marker trembles: rms over the last second of its raw position, motion removed by "
                      "third differences. It includes depth, which is the noisiest direction. There is no figure below "
                      "about ten states per second."),
    "latency": tr_noop("How long each stage took for one state: median (p50) and 99th percentile (p99) of the last two "
                       "seconds. Bands are stacked medians; the lines are the whole way of each state."),
    "budget": tr_noop("11.1 ms is one frame at 90 fps, the rate the thesis aims at."),
    "detect": tr_noop("From the frame being available on the node to the datagram being sent."),
    "network": tr_noop("From the node's send to the receive time of the master's kernel, by the estimated clocks."),
    "pair": tr_noop("Waiting until both cameras have seen a time after the state's instant."),
    "triangulate": tr_noop("From two pixels to a point in space."),
    "filter": tr_noop("The 1-euro filter before and after depth."),
    "solve": tr_noop("From points to the hand's joints."),
    "publish": tr_noop("From the finished state to the clients."),
    "rate": tr_noop("States per second and frames per second of each node; bars show lost datagrams per second."),
    "fingertip difference": tr_noop("How far the fingertips of the two runs are apart at the same instant, in mm. p50 "
                                    "and p95 are over the whole recording."),
    "measured": tr_noop("Seen by enough cameras at this instant. Drawn solid."),
    "inferred": tr_noop("Follows from what is measured through the hand model, or from a half-hidden sight. Drawn "
                        "translucent."),
    "guessed": tr_noop("The images do not determine it: the last or the most natural value. Drawn hatched."),
    "flexion": tr_noop("Bending towards the palm, in degrees; 0 is a straight finger."),
    "abduction": tr_noop("Spreading towards the thumb's side, in degrees."),
    "CMC": tr_noop("Carpometacarpal joint: the thumb's base, at the wrist."),
    "MCP": tr_noop("Metacarpophalangeal joint: the knuckle."),
    "PIP": tr_noop("Proximal interphalangeal joint: the middle joint of a finger."),
    "DIP": tr_noop("Distal interphalangeal joint: the last joint of a finger."),
    "IP": tr_noop("Interphalangeal joint: the last joint of the thumb."),
    "covariance": tr_noop("An ellipsoid of three sigma holds the true place with 97 % probability."),
    "worst axis": tr_noop("Standard deviation (one sigma) of the place along the axis in which it is known worst, in "
                          "mm."),
    "palm": tr_noop("How well the palm's place and turn are known: standard deviations along the worst axes."),
    "hand size": tr_noop("Estimated size of the hand as a factor on every length of the rig's hand (Calibrate, "
                         "Tracker)."),
    "epipolar error": tr_noop("How far the two cameras' rays miss each other, in pixels. Above one pixel, check "
                              "calibration."),
}


def tip(term: str) -> str:
    """Tooltip of a term; raises KeyError for a term that has no explanation, so that none is forgotten."""
    return tr(TERMS[term])


# -- names from outside of the window that are shown -------------------------------------------------------------------

NAMES: Final = (
    tr_noop("thumb"), tr_noop("index"), tr_noop("middle"), tr_noop("ring"), tr_noop("little"), tr_noop("wrist"),
    tr_noop("thumb tip"), tr_noop("index tip"), tr_noop("middle tip"), tr_noop("ring tip"), tr_noop("little tip"),
    tr_noop("left"), tr_noop("right"), tr_noop("red"), tr_noop("green"), tr_noop("blue"), tr_noop("yellow"),
    tr_noop("magenta"), tr_noop("cyan"), tr_noop("orange"), tr_noop("white"), tr_noop("black"),
    tr_noop("free"), tr_noop("disc"), tr_noop("sphere"), tr_noop("capsule"), tr_noop("band"), tr_noop("blob"),
    tr_noop("landmark"), tr_noop("skin"), tr_noop("squares"), tr_noop("tags"), tr_noop("spacings"))
"""Fingers, markers, cameras and colours as the shipped files name them; `tr` knows no others, and leaves them."""

HANDS: Final = {
    "left": tr_noop("left hand"), "right": tr_noop("right hand"),
    "first left": tr_noop("first left hand"), "other left": tr_noop("other left hand"),
    "first right": tr_noop("first right hand"), "other right": tr_noop("other right hand"),
}
"""By what `hand_names` calls them."""


# -- names of hands ----------------------------------------------------------------------------------------------------

def hand_names(rig: Rig | None) -> tuple[str, ...]:
    """What the hands that the rig's tracker follows are called in English, the rig's `hand` first.

    A hand that is alone needs no name: it is called "".
    """
    if rig is None or rig.other_hand is None or rig.tracker.kind == "classic":
        return ("",)
    sides = rig.hand.side, rig.other_hand.side
    return sides if sides[0] != sides[1] else (f"first {sides[0]}", f"other {sides[1]}")


def each_hand(state: HandState | None) -> list[HandState]:
    """The states of the hands that `state` tells of, the rig's `hand` first; none without a state."""
    return [hand for hand in (state, state.other if state is not None else None) if hand is not None]


# -- choice of the tracker ---------------------------------------------------------------------------------------------

KINDS: Final = {
    "classic": (tr_noop("Classic"), tr_noop("The thesis's way: triangulate each marker, smooth it, then bend the "
                                            "fingers one by one. Works with every rig. A marker needs two cameras, and "
                                            "joints do not say how well they are known.")),
    "estimator": (tr_noop("Estimator"), tr_noop("One hand estimated from everything that every camera sees, at the "
                                                "time it was seen. A marker that one camera sees counts, hidden "
                                                "fingers are carried on, and every joint says how well it is known. It "
                                                "predicts, and smooths recordings. Needs calibrated cameras with "
                                                "clocks.")),
}
IK_METHODS: Final = {
    "fabrik": (tr_noop("FABRIK, allowing for noise"),
               tr_noop("FABRIK, then a descent to the natural pose. The default.")),
    "transpose": (tr_noop("Jacobian transpose"), tr_noop("Equation 2.13. Slow where a finger is nearly straight.")),
    "pseudo_inverse": (tr_noop("pseudo-inverse"), tr_noop("Equation 2.16. Jumps near a straight finger.")),
    "svd": (tr_noop("singular values"),
            tr_noop("Equation 2.20: the pseudo-inverse without its small singular values.")),
    "dls": (tr_noop("damped least squares"), tr_noop("Equation 2.23.")),
    "newton": (tr_noop("Newton"), tr_noop("Equation 2.24, with the exact second derivatives.")),
    "lm": (tr_noop("Levenberg-Marquardt"), tr_noop("Damped Gauss-Newton steps within the limits.")),
    "closed_form": (tr_noop("closed form"), tr_noop("Equation 2.4: the last two joints bend together, DIP = 2/3 PIP.")),
}
VARIANTS: Final = {
    "full": (tr_noop("full: every joint by itself"), tr_noop("27 degrees of freedom. The default.")),
    "coupled": (tr_noop("coupled: last joints follow"),
                tr_noop("DIP = 2/3 PIP, and the middle finger does not spread. Steadier with markers on the tips only; "
                        "wrong for a fingertip that is pushed back.")),
}
LIMITS: Final = {
    "anatomical": (tr_noop("anatomical: what hands do"),
                   tr_noop("How far each joint goes in living hands. The default.")),
    "thesis": (tr_noop("thesis: equation 2.1"),
               tr_noop("The thesis's ranges, for comparing with it; some are too narrow for living hands.")),
}
OBSERVED: Final = {
    "markers": (tr_noop("Paint"), tr_noop("The painted markers of the rig's marker set.")),
    "landmarks": (tr_noop("Landmarks"), tr_noop("The joints that a detector finds on a bare hand, in the nodes or in "
                                                "another program. The rig's marker set is landmarks21 or another one "
                                                "with landmarks.")),
    "contours": (tr_noop("Contours"), tr_noop("No markers: the nodes search their pictures for the bare hand's edges. "
                                              "Calibrate, Background and skin comes first; then take the pose that the "
                                              "pictures show, and hold it.")),
    "both": (tr_noop("Paint and contours"), tr_noop("The hand's edges beside its painted markers, such as two "
                                                    "fingertips. Calibrate, Background and skin comes first here, "
                                                    "too.")),
    "landmarks_and_contours": (tr_noop("Landmarks and contours"),
                               tr_noop("The bare hand's edges beside a detector's landmarks, which find the hand at "
                                       "once. Calibrate, Background and skin comes first here, too.")),
}
LANDMARKS_ONLY: Final = tr_noop("The rig's marker set has landmarks, no paint: they are tracked. Choose Landmarks to "
                                "say so.")
FLAT_MEANING: Final = (tr_noop("The hand lies flat, as the 3-D mouse has it: only forefinger, thumb and little finger "
                               "move. Where a board on the table has placed the rig, the palm slides on the table, and "
                               "one camera suffices."))
SIZE_MEANING: Final = (tr_noop("The hand's size is estimated as it moves, so that a hand file that is some percent too "
                               "large or too small does no harm. Open and close the hand for half a minute."))

SETTLED_SD = 0.02
"""A size that is not known to 2 % is no better than a hand chosen by its length."""


def size_known(state: HandState | None) -> bool:
    """Whether the state says how large the hand is."""
    return state is not None and math.isfinite(state.hand_scale_sd) and state.hand_scale_sd > 0.0


def size_settled(state: HandState | None) -> bool:
    """Whether the size is known well enough to be written into the rig's hand."""
    return state is not None and size_known(state) and state.hand_scale_sd <= SETTLED_SD


def scale_text(state: HandState, *, known: bool = True) -> str:
    """E.g. "1.03 ± 0.02" with the digits that mean something; not `known` how sure: "1.03"."""
    if not known:
        return f"{state.hand_scale:.2f}"
    digits = 2 if state.hand_scale_sd >= 0.005 else 3
    return f"{state.hand_scale:.{digits}f} ± {max(state.hand_scale_sd, 10.0**-digits):.{digits}f}"


def size_text(state: HandState | None, rig: Rig) -> str:
    """The estimated size in words; what to do when there is none yet."""
    if not rig.tracker.float_scale or rig.tracker.kind == "classic":
        return ""
    if state is None or not size_known(state):
        return tr("No size yet: start, and show the hand.")
    before, after = 1e3 * hand_length(rig.hand), 1e3 * hand_length(rig.hand) * state.hand_scale
    if not size_settled(state):
        return tr("{scale_text} of the rig's hand: not certain yet. Open and close the hand, and turn it.",
                  scale_text=scale_text(state))
    if abs(state.hand_scale - 1.0) <= state.hand_scale_sd:
        return tr("{scale_text} of the rig's hand: it fits ({before:.0f} mm from wrist to middle fingertip).",
                  scale_text=scale_text(state), before=before)
    return tr("{scale_text} of the rig's hand: {after:.0f} mm long instead of {before:.0f} mm.",
              scale_text=scale_text(state), after=after, before=before)


# -- remaining time ----------------------------------------------------------------------------------------------------

_LEAST_DONE = 0.03
_LEAST_S = 0.5


class Remaining:
    """Fed with the fraction done and the time; tells the remaining time once there is enough to judge by."""

    def __init__(self, began_s: float) -> None:
        self._began_s = began_s
        self.fraction = 0.0
        self._at_s = began_s

    def report(self, fraction: float, now_s: float) -> None:
        """`fraction` 0..1 is done at `now_s`; work that goes back a little stays where it was."""
        self.fraction = max(self.fraction, min(fraction, 1.0))
        self._at_s = now_s

    def text(self, now_s: float) -> str:
        """Remaining time in words, "" while it cannot be told."""
        elapsed = self._at_s - self._began_s
        if self.fraction < _LEAST_DONE or elapsed < _LEAST_S:
            return ""
        left = elapsed * (1.0 - self.fraction) / self.fraction - (now_s - self._at_s)
        if left < 1.0:
            return tr("a moment left")
        if left < 90.0:
            return tr("about {left:.0f} s left", left=left)
        return tr("about {left:.0f} min left", left=left / 60.0)


# -- appearance of grades ----------------------------------------------------------------------------------------------

GRADES: dict[Grade, Look] = {
    Grade.GOOD: Look(tr_noop("good"), "disc", "good", tr_noop("May be used as it is.")),
    Grade.FAIR: Look(tr_noop("usable"), "half", "caution", tr_noop("May be used; better is possible.")),
    Grade.POOR: Look(tr_noop("not usable"), "cross", "bad", tr_noop("Must not be used.")),
}
