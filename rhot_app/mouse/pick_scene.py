"""The scene of the 3-D cursor: balls over a ground plane, which are picked, moved and put down. Moves can be undone.

Cursor frame, metres. No Qt.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.mouse.pointer import BUTTONS, GROUND_M, POLE_M, MouseState

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Ball:
    """A ball. `centre` (3,) m, cursor frame; `rgb` 0..255."""

    name: str
    centre: tuple[float, float, float]
    radius_m: float
    rgb: tuple[int, int, int]

    @property
    def on_ground(self) -> Ball:
        """The same ball, lying on the ground below."""
        return replace(self, centre=(self.centre[0], self.centre[1], self.radius_m))


START: Final = (Ball("orange ball", (-0.12, 0.06, 0.03), 0.03, (213, 94, 0)),
                Ball("blue ball", (0.12, 0.1, 0.025), 0.025, (0, 114, 178)),
                Ball("green ball", (0.06, -0.09, 0.035), 0.035, (0, 158, 115)))
"""Colours that are distinct with any colour vision (Okabe and Ito 2008)."""


class PickScene:
    """Balls and their selection. The thumb picks and releases the selected ball; the little finger puts it on the
    ground."""

    def __init__(self, balls: tuple[Ball, ...] = START) -> None:
        self.balls = list(balls)
        self.selected: int | None = None  # the ball that the thumb would pick
        self.held: int | None = None
        self._offset = np.zeros(3)  # from the cursor to the held ball
        self._before: Ball | None = None  # the held ball where it was picked
        self._undo: list[tuple[int, Ball]] = []
        self._pressed: frozenset[str] = frozenset()

    def feed(self, mouse: MouseState) -> None:
        """Update by one mouse state: select, pick, move and release."""
        changed, self._pressed = mouse.pressed ^ self._pressed, mouse.pressed
        if mouse.cursor is None:
            if self.held is not None and "thumb" not in mouse.pressed:
                self._release()
            return
        if self.held is None:
            self.selected = self._nearest(mouse.cursor)
            if "thumb" in changed & mouse.pressed and self.selected is not None:
                self.held, self._before = self.selected, self.balls[self.selected]
                self._offset = np.array(self._before.centre) - mouse.cursor
        if self.held is not None:
            self._carry(self.held, mouse.cursor + self._offset)
            if "thumb" not in mouse.pressed:
                self._release()
        if "little" in changed & mouse.pressed and self.held is None and self.selected is not None:
            self._put(self.selected, self.balls[self.selected].on_ground)

    def interrupt(self) -> None:
        """Release a held ball where it is, because the mouse is used elsewhere. A thumb that is spread afterwards picks
        nothing until it returns."""
        if self.held is not None:
            self._release()
        self.selected, self._pressed = None, frozenset(BUTTONS)

    def undo(self) -> str:
        """Undo the last move. Returns a sentence on what was done, or why nothing was."""
        if self.held is not None:
            return f"Let go of the {self.balls[self.held].name} first; then its move can be undone."
        if not self._undo:
            return "There is nothing to undo: no ball has been moved."
        number, ball = self._undo.pop()
        self.balls[number] = ball
        return f"The {ball.name} is back where it was."

    def _nearest(self, cursor: Array) -> int | None:
        """The nearest ball, if its centre is within two radii of the cursor; else None."""
        if not self.balls:
            return None
        away = [float(np.linalg.norm(np.array(ball.centre) - cursor)) for ball in self.balls]
        number = int(np.argmin(away))
        return number if away[number] <= 2.0 * self.balls[number].radius_m else None

    def _carry(self, number: int, place: Array) -> None:
        ball = self.balls[number]
        half = 0.5 * np.array(GROUND_M)
        x, y = np.clip(place[:2], -half, half)
        z = np.clip(place[2], ball.radius_m, POLE_M)
        self.balls[number] = replace(ball, centre=(float(x), float(y), float(z)))

    def _release(self) -> None:
        assert self.held is not None and self._before is not None
        now, self.balls[self.held] = self.balls[self.held], self._before
        self._put(self.held, now)
        self.held = self._before = None

    def _put(self, number: int, ball: Ball) -> None:
        if ball != self.balls[number]:
            self._undo.append((number, self.balls[number]))
            self.balls[number] = ball
