"""The look of knowledge in the scene: measured is solid, inferred translucent, guessed hatched grey, unknown absent."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rhot_app.tracking.state import Knowledge
from rhot_app.ui.models.palette import Scheme, rgb_of

Codes = NDArray[np.uint8]
Colours = NDArray[np.uint8]

ALPHA: dict[Knowledge, int] = {Knowledge.MEASURED: 255, Knowledge.INFERRED: 115, Knowledge.GUESSED: 135,
                               Knowledge.UNKNOWN: 0}
"""How solid each kind is; what is guessed is hatched besides."""

_ALPHAS = np.array([ALPHA[knowledge] for knowledge in Knowledge], np.uint8)


def tinted(colour: str, knowledge: Codes, scheme: Scheme) -> Colours:
    """(N, 4) bytes of something of one colour: grey where it is guessed."""
    table = np.zeros((len(Knowledge), 4), np.uint8)
    for kind in Knowledge:
        table[kind] = (*rgb_of(scheme.guessed if kind is Knowledge.GUESSED else colour), ALPHA[kind])
    return np.asarray(table[knowledge])


def with_knowledge(colours: Colours, knowledge: Codes) -> Colours:
    """The same colours (N, 4), as solid as each is known; what has a colour of its own keeps it."""
    shown = colours.copy()
    shown[:, 3] = _ALPHAS[knowledge]
    return shown
