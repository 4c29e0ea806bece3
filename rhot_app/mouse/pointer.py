"""From hand states to a 3-D cursor and two buttons (Rehg 1995, 4.3.4). No Qt, no sockets.

The palm's place in a plane moves the foot of the pole over the ground. The height of the index fingertip above the palm
sets the pole's length. Thumb and little finger, spread away from the hand, press the two buttons.

Cursor frame: x right, y forward (away from the person), z up, metres; the origin lies in the middle of the ground.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from rhot_app.hand.skeleton import FINGERS, JOINTS
from rhot_app.state import Condition, HandState, Knowledge

Array = NDArray[np.float64]

GROUND_M: Final = (0.48, 0.36)
"""Size of the ground, right and forward: a computer screen of 24 inches and 4:3."""

POLE_M: Final = 0.24
"""The longest pole."""

HOME_S: Final = 0.5
"""The hand's place of rest is the mean of the states of so long: the noise of a palm is then a fifth of one state's."""

Z_95: Final = 1.959964
"""Quantile of the normal distribution: 95 % of it lies within so many standard deviations of the mean."""

BUTTONS: Final = ("thumb", "little")
_ROOT: Final = {"thumb": JOINTS.index("thumb_cmc"), "little": JOINTS.index("little_mcp")}
_TIP: Final = {"thumb": JOINTS.index("thumb_tip"), "little": JOINTS.index("little_tip")}
_AWAY: Final = {"thumb": 1.0, "little": -1.0}
"""Sign of the turn, from x to y of the palm frame, by which a right hand spreads the finger."""

_INDEX: Final = FINGERS.index("index")
_INDEX_TIP: Final = JOINTS.index("index_tip")
_WRIST: Final = JOINTS.index("wrist")


@dataclass(frozen=True, slots=True)
class MouseSettings:
    """How a hand moves the cursor. A person may change all of it.

    `gain`: metres of the cursor per metre of the palm: 3 brings 160 mm, what a forearm at rest on its elbow reaches,
    over the whole ground. `height_gain`: per metre of the index fingertip: 6 for the 40 mm by which a finger lifts.
    `height_from`: what sets the height; "palm" is the palm's own, for a hand whose index finger is not observed.
    `press_rad`, `release_rad`: how far a finger is spread from its rest to press, and to release. The first is half of
    a little finger's active abduction of about 30 degrees, the second half of the first.
    `on_table`: the palm slides on the plane, as Rehg's does, and has no height. One camera then suffices.
    """

    gain: float = 3.0
    height_gain: float = 6.0
    height_from: Literal["index", "palm"] = "index"
    press_rad: float = float(np.radians(15.0))
    release_rad: float = float(np.radians(7.5))
    on_table: bool = False


@dataclass(frozen=True, slots=True)
class MouseState:
    """One instant. `cursor` (3,) m; None before the place of rest is known. `needs`: sentences on what is missing.
    `observed`: whether all of the cursor follows the hand at this instant."""

    t_master_ns: int
    condition: Condition
    cursor: Array | None
    pressed: frozenset[str]  # of BUTTONS
    needs: tuple[str, ...] = ()
    observed: bool = False

    def is_pressed(self, button: str) -> bool:
        """Whether a button is held."""
        return button in self.pressed


GAP_NS: Final = round(1e9 * HOME_S)
"""ns: states farther apart are of different stays of the hand. A slow rig's rest is the mean of two or three."""


STILL_M: Final = 0.01
"""m: a hand that is held still moves no farther: three standard deviations between two instants of one held in the air,
whose sway is 2 mm and 1.2 degrees (resources/motions/tap.json)."""

STILL: Final = 0.1
"""rad: the same of its angles."""


class _Rest:
    """The mean of a value over the first half second in which it was known without a gap and still; each part of a hand
    has its own."""

    def __init__(self, still: float | Array) -> None:
        """`still`: as of the value, how far it moves at most."""
        self._still = still
        self._first_ns = self._last_ns = -GAP_NS
        self._values: list[Array] = []
        self.mean: Array | None = None  # None until it is taken

    def take(self, t_ns: int, value: Array) -> None:
        """One more known value."""
        if self.mean is not None:
            return
        gap = not 0 <= t_ns - self._last_ns < GAP_NS
        if not self._values or gap or bool(np.any(np.abs(value - self._values[0]) > self._still)):
            self._first_ns, self._values = t_ns, []
        self._last_ns = t_ns
        self._values.append(value)
        if t_ns - self._first_ns >= round(1e9 * HOME_S):
            self.mean = np.mean(self._values, axis=0)


class Mouse:
    """Feed it states in order. Where each part of the hand is first seen for half a second is its rest; `rest` takes
    another one."""

    def __init__(self, settings: MouseSettings | None = None, up: Array | None = None) -> None:
        """`up` (3,): the plane's normal in the rig frame, when the rig knows a table; else the palm at rest lies in the
        plane."""
        self.settings = settings or MouseSettings()
        self._up = up
        self._foot, self._height = np.zeros(2), 0.0
        self.rest()

    def rest(self) -> None:
        """Take the next half second as the hand's rest; the buttons are released."""
        self._palm = _Rest(np.array([STILL, STILL, STILL, STILL_M]))  # of each row of the pose
        self._index = _Rest(STILL_M)
        self._fingers = {button: _Rest(STILL) for button in BUTTONS}
        self._pressed: frozenset[str] = frozenset()

    def feed(self, state: HandState) -> MouseState:
        """The mouse after one more state. Without a hand the cursor stays and the buttons are released."""
        if not state.tracked:
            self._pressed = frozenset()
            return self._state(state, "No hand is tracked. The cursor stays, and the buttons are released.")
        if not _knows(state.joint_knowledge[_WRIST]) or not np.isfinite(state.world_from_palm).all():
            return self._state(state, "The cursor stays: it needs the palm, which is not seen well enough.")
        self._palm.take(state.t_master_ns, state.world_from_palm)
        if _knows(state.joint_knowledge[_INDEX_TIP]):
            self._index.take(state.t_master_ns, _index_tip(state))
        clicks, home = self._click(state), self._palm.mean
        if home is None:
            return self._state(state, "Hold the hand still for half a second: that becomes the cursor's origin.")
        needs = self._move(state, home[:3, 3], cursor_axes(home, self._up))
        return self._state(state, *needs, *clicks, observed=not needs)

    def _state(self, state: HandState, *needs: str, observed: bool = False) -> MouseState:
        cursor = None if self._palm.mean is None else np.array([*self._foot, self._height])
        return MouseState(state.t_master_ns, state.condition, cursor, self._pressed, needs, observed)

    def _move(self, state: HandState, origin: Array, axes: Array) -> list[str]:
        """Move the cursor; what it needs and does not have."""
        palm = palm_on_plane(state, origin, axes[2]) if self.settings.on_table else state.world_from_palm[:3, 3]
        right, forward, up = axes @ (palm - origin)
        half = 0.5 * np.array(GROUND_M)
        self._foot = np.clip(self.settings.gain * np.array([right, forward]), -half, half)
        if self.settings.height_from == "index":
            if not _knows(state.joint_knowledge[_INDEX_TIP]):
                return ["The height stays: it needs the index fingertip, which is not seen."]
            if self._index.mean is None:
                return ["Hold the index finger still for half a second: that becomes the ground."]
            up = axes[2] @ (_index_tip(state) - self._index.mean)
        self._height = float(np.clip(self.settings.height_gain * up, 0.0, POLE_M))
        return []

    def _click(self, state: HandState) -> list[str]:
        """Press and release; what the buttons need and do not have."""
        needs = []
        for button, rest in self._fingers.items():
            if not _knows(state.joint_knowledge[_TIP[button]]):
                needs.append(f"The {button} button stays as it is: the tip of the {button} is not seen.")
                continue
            spread, sd = finger_spread(state, button)
            rest.take(state.t_master_ns, np.array(spread))
            if rest.mean is None:
                needs.append(f"Hold the {button} still for half a second: that releases its button.")
            elif self._certain(spread - float(rest.mean), sd, held=button in self._pressed):
                self._pressed ^= {button}
        return needs

    def _certain(self, spread: float, sd: float, *, held: bool) -> bool:
        """Whether a button changes: the spread is beyond its threshold, and surely beyond the other one."""
        press, release = self.settings.press_rad, self.settings.release_rad
        if held:
            return spread < release and spread + Z_95 * sd < press
        return spread > press and spread - Z_95 * sd > release


def palm_on_plane(state: HandState, place: Array, normal: Array) -> Array:
    """(3,) m: the palm's likeliest place in the plane through `place`, by the state's covariance.

    It is the least-squares update by a measurement without noise: one camera's palm slides along the line of sight to
    the plane. Without a covariance it falls along `normal`.
    """
    palm = state.world_from_palm[:3, 3]
    along = state.palm_covariance[:3, :3] @ normal
    if not (np.isfinite(along).all() and normal @ along > 0.0):
        along = normal
    return np.asarray(palm - along * (normal @ (palm - place)) / (normal @ along))


def finger_spread(state: HandState, button: str) -> tuple[float, float]:
    """Angle in the palm's plane from its x axis to the finger's tip, seen from the finger's root, and its standard
    deviation, rad; 0 from a tracker without covariances. It grows away from the hand.

    One marker at the tip does not say which of the finger's joints has moved; this angle does not ask.
    """
    palm = state.world_from_palm[:3, :3]
    finger = FINGERS.index(button)
    way = palm.T @ (state.fingertip_positions[finger] - state.joint_positions[_ROOT[button]])
    length = float(np.hypot(way[0], way[1]))
    across = palm @ np.array([-way[1], way[0], 0.0]) / length**2
    variance = (across @ state.fingertip_covariances[finger] @ across
                + palm[:, 2] @ state.palm_covariance[3:, 3:] @ palm[:, 2])
    hand = 1.0 if _is_right(state) else -1.0
    return hand * _AWAY[button] * float(np.arctan2(way[1], way[0])), float(np.sqrt(max(np.nan_to_num(variance), 0.0)))


def _is_right(state: HandState) -> bool:
    """Whether the thumb's root lies on the side of +y, as on a right hand."""
    palm = state.world_from_palm
    return bool(palm[:3, 1] @ (state.joint_positions[_ROOT["thumb"]] - state.joint_positions[_ROOT["little"]]) > 0.0)


def _index_tip(state: HandState) -> Array:
    """(3,) m, from the palm's origin, along the rig's axes."""
    return np.asarray(state.fingertip_positions[_INDEX] - state.world_from_palm[:3, 3])


def _knows(code: int) -> bool:
    return bool(code <= Knowledge.INFERRED)


def cursor_axes(world_from_palm: Array, up: Array | None) -> Array:
    """(3, 3): right, forward and up of the cursor's frame as rows in the rig frame, for a palm at rest (4, 4), which
    may be a mean of several. `up`: as of `Mouse`."""
    distal, dorsal = world_from_palm[:3, 0], world_from_palm[:3, 2]
    normal = dorsal / np.linalg.norm(dorsal) if up is None else up
    forward = distal - normal * (normal @ distal)
    forward /= np.linalg.norm(forward)
    return np.array([np.cross(forward, normal), forward, normal])
