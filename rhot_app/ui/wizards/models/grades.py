"""How a grade looks: a word, a shape and a tone, as every state of the app has them."""

from __future__ import annotations

from rhot_app.calibration.verdict import Grade
from rhot_app.ui.models.words import Look

GRADES: dict[Grade, Look] = {
    Grade.GOOD: Look("good", "disc", "good", "May be used as it is."),
    Grade.FAIR: Look("usable", "half", "caution", "May be used; better is possible."),
    Grade.POOR: Look("not usable", "cross", "bad", "Must not be used."),
}
