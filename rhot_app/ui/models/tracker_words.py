"""The choice of the tracker in words: what each is good at, what stands in the way, how large the hand seems to be."""

from __future__ import annotations

import math
from typing import Final

from rhot_app.hand.anthropometry import hand_length
from rhot_app.project import Rig, TrackerSettings
from rhot_app.tracking.state import HandState

KINDS: Final = {
    "classic": ("Classic", "The thesis's way: triangulate each marker, smooth it, then bend the fingers one by one. "
                "Works with every rig. A marker needs two cameras, and joints do not say how well they are known."),
    "estimator": ("Estimator", "One hand estimated from everything that every camera sees, at the time it was seen. A "
                  "marker that one camera sees counts, hidden fingers are carried on, and every joint says how well "
                  "it is known. It predicts, and smooths recordings. Needs calibrated cameras with clocks."),
}
VARIANTS: Final = {
    "full": ("full: every joint by itself", "27 degrees of freedom. The default."),
    "coupled": ("coupled: last joints follow", "DIP = 2/3 PIP, and the middle finger does not spread. Steadier with "
                "markers on the tips only; wrong for a fingertip that is pushed back."),
}
LIMITS: Final = {
    "anatomical": ("anatomical: what hands do", "How far each joint goes in living hands. The default."),
    "thesis": ("thesis: equation 2.1", "The thesis's ranges, for comparing with it; some are too narrow for "
               "living hands."),
}
SIZE_MEANING: Final = ("The hand's size is estimated as it moves, so that a hand file that is some percent too large "
                       "or too small does no harm. Open and close the hand for half a minute.")

SETTLED_SD = 0.02
"""A size that is not known to 2 % is no better than a hand chosen by its length."""


def settings_text(settings: TrackerSettings) -> str:
    """One line, e.g. "estimator, full, anatomical limits, size estimated"."""
    if settings.kind == "classic":
        return "classic"
    size = ", size estimated" if settings.float_scale else ""
    return f"estimator, {settings.variant}, {settings.limits} limits{size}"


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
        return "No size yet: start, and show the hand."
    before, after = 1e3 * hand_length(rig.hand), 1e3 * hand_length(rig.hand) * state.hand_scale
    if not size_settled(state):
        return f"{scale_text(state)} of the rig's hand: not certain yet. Open and close the hand, and turn it."
    if abs(state.hand_scale - 1.0) <= state.hand_scale_sd:
        return f"{scale_text(state)} of the rig's hand: it fits ({before:.0f} mm from wrist to middle fingertip)."
    return f"{scale_text(state)} of the rig's hand: {after:.0f} mm long instead of {before:.0f} mm."
