"""From hand states to a 3-D cursor and two buttons (Rehg 1995, 4.3.4). No Qt, no sockets.

The palm's position in a plane moves the cursor over the ground. The height of the index fingertip above the palm sets
the cursor's height, drawn as a pole. Thumb and little finger, spread away from the hand, press the two buttons.

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
"""m: largest height of the cursor, drawn as a pole."""

HOME_S: Final = 0.5
"""s: time over which the resting pose is averaged: the palm's noise is then a fifth of that of one state."""

Z_95: Final = 1.959964
"""Two-sided 95 % quantile of the standard normal distribution."""

BUTTONS: Final = ("thumb", "little")
_ROOT: Final = {"thumb": JOINTS.index("thumb_cmc"), "little": JOINTS.index("little_mcp")}
_TIP: Final = {"thumb": JOINTS.index("thumb_tip"), "little": JOINTS.index("little_tip")}
_AWAY: Final = {"thumb": 1.0, "little": -1.0}
"""Sign of the rotation, from x to y of the palm frame, by which a right hand spreads the finger."""

_INDEX: Final = FINGERS.index("index")
_INDEX_TIP: Final = JOINTS.index("index_tip")
_WRIST: Final = JOINTS.index("wrist")


@dataclass(frozen=True, slots=True)
class MouseSettings:
    """How a hand moves the cursor. The user may change all of it.

    `gain`: metres of the cursor per metre of the palm. With 3, the 160 mm range of a forearm that rests on its elbow
    spans the ground. `height_gain`: per metre of the index fingertip: 6 for the 40 mm by which a finger lifts.
    `height_from`: source of the height; "palm" is for a hand whose index finger is not observed.
    `press_rad`, `release_rad`: thresholds of a finger's spread from its resting angle. The first is half of a little
    finger's active abduction of about 30 degrees, the second half of the first.
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
    """The mouse at one instant. `cursor` (3,) m; None before the resting pose is known. `needs`: sentences on what is
    missing. `observed`: whether all of the cursor's coordinates are measured at this instant."""

    t_master_ns: int
    condition: Condition
    cursor: Array | None
    pressed: frozenset[str]  # of BUTTONS
    needs: tuple[str, ...] = ()
    observed: bool = False

    def is_pressed(self, button: str) -> bool:
        """Whether a button is pressed."""
        return button in self.pressed


GAP_NS: Final = round(1e9 * HOME_S)
"""ns: a longer gap between states restarts the averaging. On a slow rig the mean is that of two or three states."""


STILL_M: Final = 0.01
"""m: largest motion of a hand that is held still: three standard deviations of the difference of two instants, for the
sway of a hand in the air, 2 mm and 1.2 degrees (resources/motions/tap.json)."""

STILL: Final = 0.1
"""rad: the same of its angles."""


class _Rest:
    """The resting value of one part of the hand: the mean over the first HOME_S in which it was known, without gaps,
    and still."""

    def __init__(self, still: float | Array) -> None:
        """`still`: largest change of each component of a value that is at rest."""
        self._still = still
        self._first_ns = self._last_ns = -GAP_NS
        self._values: list[Array] = []
        self.mean: Array | None = None  # None until it is known

    def take(self, t_ns: int, value: Array) -> None:
        """Take one more value."""
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
    """Maps hand states, fed in order, to mouse states. The resting pose of each part of the hand is the first one that
    is held for HOME_S; `rest` starts over."""

    def __init__(self, settings: MouseSettings | None = None, up: Array | None = None) -> None:
        """`up` (3,): the plane's unit normal in the rig frame; None: the resting palm defines the plane."""
        self.settings = settings or MouseSettings()
        self._up = up
        self._foot, self._height = np.zeros(2), 0.0
        self.rest()

    def rest(self) -> None:
        """Release the buttons, and take the next resting pose as the origin."""
        self._palm = _Rest(np.array([STILL, STILL, STILL, STILL_M]))  # columns of the pose: rotation and position
        self._index = _Rest(STILL_M)
        self._fingers = {button: _Rest(STILL) for button in BUTTONS}
        self._pressed: frozenset[str] = frozenset()

    def feed(self, state: HandState) -> MouseState:
        """The mouse after one more hand state. Without a hand the cursor stays and the buttons are released."""
        if not state.tracked:
            self._pressed = frozenset()
            return self._state(state, "No hand is tracked. The cursor stays, and the buttons are released.")
        if not _is_estimated(state.joint_knowledge[_WRIST]) or not np.isfinite(state.world_from_palm).all():
            return self._state(state, "The cursor stays: it needs the palm, which is not seen well enough.")
        self._palm.take(state.t_master_ns, state.world_from_palm)
        if _is_estimated(state.joint_knowledge[_INDEX_TIP]):
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
        """Move the cursor. Returns sentences on what is missing."""
        palm = palm_on_plane(state, origin, axes[2]) if self.settings.on_table else state.world_from_palm[:3, 3]
        right, forward, up = axes @ (palm - origin)
        half = 0.5 * np.array(GROUND_M)
        self._foot = np.clip(self.settings.gain * np.array([right, forward]), -half, half)
        if self.settings.height_from == "index":
            if not _is_estimated(state.joint_knowledge[_INDEX_TIP]):
                return ["The height stays: it needs the index fingertip, which is not seen."]
            if self._index.mean is None:
                return ["Hold the index finger still for half a second: that becomes the ground."]
            up = axes[2] @ (_index_tip(state) - self._index.mean)
        self._height = float(np.clip(self.settings.height_gain * up, 0.0, POLE_M))
        return []

    def _click(self, state: HandState) -> list[str]:
        """Press and release the buttons. Returns sentences on what is missing."""
        needs = []
        for button, rest in self._fingers.items():
            if not _is_estimated(state.joint_knowledge[_TIP[button]]):
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
        """Whether a button changes: the spread is beyond its threshold, and beyond the other one with 95 %
        confidence."""
        press, release = self.settings.press_rad, self.settings.release_rad
        if held:
            return spread < release and spread + Z_95 * sd < press
        return spread > press and spread - Z_95 * sd > release


def palm_on_plane(state: HandState, place: Array, normal: Array) -> Array:
    """(3,) m: the most probable position of the palm in the plane through `place` (3,) with unit `normal` (3,).

    It is the Kalman update by a noiseless measurement: with one camera the palm moves along the line of sight to the
    plane. Without a covariance it is projected along `normal`.
    """
    palm = state.world_from_palm[:3, 3]
    along = state.palm_covariance[:3, :3] @ normal
    if not (np.isfinite(along).all() and normal @ along > 0.0):
        along = normal
    return np.asarray(palm - along * (normal @ (palm - place)) / (normal @ along))


def finger_spread(state: HandState, button: str) -> tuple[float, float]:
    """Angle in the palm's plane between its x axis and the line from the finger's root to its tip, positive away from
    the hand; and its standard deviation, 0 from a tracker without covariances. rad.

    It does not depend on which joint of the finger has moved, which one marker at the tip cannot tell.
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
    """Whether the thumb's root lies on the +y side of the palm frame, as on a right hand."""
    palm = state.world_from_palm
    return bool(palm[:3, 1] @ (state.joint_positions[_ROOT["thumb"]] - state.joint_positions[_ROOT["little"]]) > 0.0)


def _index_tip(state: HandState) -> Array:
    """(3,) m: from the palm's origin, in axes of the rig frame."""
    return np.asarray(state.fingertip_positions[_INDEX] - state.world_from_palm[:3, 3])


def _is_estimated(code: int) -> bool:
    return bool(code <= Knowledge.INFERRED)


def cursor_axes(world_from_palm: Array, up: Array | None) -> Array:
    """(3, 3): rows right, forward and up of the cursor frame in the rig frame, for a resting palm (4, 4), which may be
    a mean of several poses. `up`: see `Mouse`."""
    distal, dorsal = world_from_palm[:3, 0], world_from_palm[:3, 2]
    normal = dorsal / np.linalg.norm(dorsal) if up is None else up
    forward = distal - normal * (normal @ distal)
    forward /= np.linalg.norm(forward)
    return np.array([np.cross(forward, normal), forward, normal])
