"""A scripted hand that controls the 3-D mouse: waypoints in the cursor frame become a motion of the twin.

The script has the hand's true lengths and the mouse's settings, but not the tracker's result: it does not correct the
cursor, as a person would. Movements have minimum jerk (Flash and Hogan 1985).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model
from rhot_app.hand.skeleton import ANGLES, HandPose
from rhot_app.mouse.model import FLAT_DEG
from rhot_app.mouse.pick_scene import START, Ball
from rhot_app.mouse.pointer import BUTTONS, HOME_S, MouseSettings
from rhot_app.simulator.scene.motion import BACK_FACING, FACING, Sway
from rhot_app.simulator.scene.motion_file import Key, MotionFile

Array = NDArray[np.float64]

Side = Literal["palm", "back"]
FACINGS: Final = {"palm": FACING, "back": BACK_FACING}

TILT_DEG: Final = 45.0
"""Tilt of the hand's plane towards the cameras, as in Rehg 1995, 4.3.4. RHOT's cameras usually see the palm, and a
finger that bends towards them from its tip. Of a hand on a table they see the back and the whole finger."""

KEY_S: Final = 0.05
"""s: interval of the keys of the motion's spline, unless a faster hand needs more."""

CLICK_S: Final = 0.15
"""s: time in which a finger spreads or returns."""

LEAD_S: Final = 1.0 + HOME_S
"""s: initial rest, in which the tracker converges and the mouse takes the resting pose."""

SPREAD_DEG: Final = 27.0
"""Spread of a finger that presses: the threshold and 12 degrees, its natural variation (`rhot_app.hand.limits`)."""

_SPREADS: Final = {"thumb": ("thumb_cmc_flexion", -1.0), "little": ("little_mcp_abduction", -1.0)}
"""Angle that spreads each button's finger in the palm's plane, and its sign."""


@dataclass(frozen=True, slots=True)
class Waypoint:
    """The wanted mouse at a time: `cursor` (3,) m; `spread` 0..1 of each button's finger; `turn_rad`: palm's rotation
    about the normal."""

    t_s: float
    cursor: tuple[float, float, float] = (0.0, 0.0, 0.0)
    spread: tuple[float, float] = (0.0, 0.0)  # as BUTTONS
    turn_rad: float = 0.0


class Script:
    """A list of waypoints that commands extend."""

    def __init__(self, *, turn_deg: float = 0.0) -> None:
        """`turn_deg`: rotation of the resting palm on the table."""
        turn = float(np.radians(turn_deg))
        self.waypoints = [Waypoint(0.0, turn_rad=turn), Waypoint(LEAD_S, turn_rad=turn)]

    @property
    def end_s(self) -> float:
        """Time of the last waypoint."""
        return self.waypoints[-1].t_s

    def wait(self, seconds: float) -> None:
        """Hold the last waypoint."""
        self._add(seconds)

    def move(self, cursor: tuple[float, float, float], seconds: float, *, release: bool = False) -> None:
        """Move the cursor. `release`: spread fingers return during the movement."""
        self._add(seconds, cursor=cursor, spread=(0.0, 0.0) if release else None)

    def spread(self, button: str, *, out: bool) -> None:
        """Spread a finger, or let it return."""
        spread = list(self.waypoints[-1].spread)
        spread[BUTTONS.index(button)] = float(out)
        self._add(CLICK_S, spread=(spread[0], spread[1]))

    def click(self, button: str, held_s: float = 0.15) -> None:
        """Press and release."""
        self.spread(button, out=True)
        self.wait(held_s)
        self.spread(button, out=False)

    def _add(self, seconds: float, *, cursor: tuple[float, float, float] | None = None,
             spread: tuple[float, float] | None = None) -> None:
        last = self.waypoints[-1]
        self.waypoints.append(Waypoint(last.t_s + seconds, cursor or last.cursor, spread or last.spread, last.turn_rad))

    def sample(self, times_s: Array) -> Array:
        """(N, 6): cursor m, spreads and turn rad at times (N,), by minimum-jerk movements."""
        rows = np.array([[*point.cursor, *point.spread, point.turn_rad] for point in self.waypoints])
        ends = np.array([point.t_s for point in self.waypoints])
        after = np.clip(np.searchsorted(ends, times_s, side="right"), 1, len(ends) - 1)
        part = np.clip((times_s - ends[after - 1]) / (ends[after] - ends[after - 1]), 0.0, 1.0)
        part = part**3 * (10.0 - 15.0 * part + 6.0 * part**2)
        return np.asarray(rows[after - 1] + part[:, None] * (rows[after] - rows[after - 1]))


def carrying(balls: tuple[Ball, ...] = START) -> Script:
    """A hand that picks each ball, carries it to the position of the next one, and returns to rest."""
    script = Script()
    for ball, following in zip(balls, (*balls[1:], balls[0]), strict=True):
        x, y, z = following.centre
        script.move(ball.centre, 1.0)
        script.wait(0.3)
        script.spread("thumb", out=True)
        script.wait(0.3)
        script.move((0.6 * x, 0.6 * y, 0.12), 0.8)
        script.move((x, y - 3.0 * ball.radius_m, z), 0.8)
        script.spread("thumb", out=False)
        script.wait(0.4)
    script.move((0.0, 0.0, 0.0), 1.0)
    return script


def resting(seconds: float) -> Script:
    """A hand at rest."""
    script = Script()
    script.wait(seconds)
    return script


def home_pose(facing: Side) -> Array:
    """(3, 3) world_from_palm of a hand at rest with the side `facing` towards the cameras."""
    return np.asarray(Rotation.from_rotvec([np.radians(TILT_DEG), 0.0, 0.0]).as_matrix() @ FACINGS[facing])


def motion_file(script: Script, anatomy: HandAnatomy, settings: MouseSettings, sway: Sway, *,
                key_s: float = KEY_S, posture: Mapping[str, float] = FLAT_DEG, facing: Side = "palm"
                ) -> MotionFile:
    """The script as a motion of a hand in a flat `posture`, degrees, with a key every `key_s`. `facing`: the side of
    the hand towards the scene's cameras (`TwinSettings.facing`)."""
    period = script.end_s + 1.0
    times = np.arange(0.0, period - 0.5 * key_s, key_s)
    home = home_pose(facing)
    lengths, flexions = _index_heights(anatomy, posture)
    keys = []
    for t_s, row in zip(times, script.sample(times), strict=True):
        cursor, spread, turn = row[:3], row[3:5], row[5]
        place = home @ np.array([cursor[1], -cursor[0], 0.0]) / settings.gain
        palm = home @ Rotation.from_rotvec([0.0, 0.0, turn]).as_matrix()
        rotation = Rotation.from_matrix(palm @ FACINGS[facing].T).as_rotvec(degrees=True)
        index = float(np.interp(cursor[2] / settings.height_gain, lengths, flexions))
        angles = {"index_mcp_flexion": round(index, 3)}
        for button, out in zip(BUTTONS, spread, strict=True):
            name, sign = _SPREADS[button]
            angles[name] = round(posture[name] + sign * SPREAD_DEG * float(out), 3)
        keys.append(Key(round(float(t_s), 6), _triple(1e3 * place), _triple(rotation), angles))
    words = "The hand works the 3-D mouse: it picks three balls and carries them."
    return MotionFile("mouse", words, round(float(period), 6), tuple(keys), dict(posture), sway)


def _triple(values: Array) -> tuple[float, float, float]:
    x, y, z = (round(float(value), 3) for value in values)
    return x, y, z


def _index_heights(anatomy: HandAnatomy, posture: Mapping[str, float]) -> tuple[Array, Array]:
    """Heights, m, of the index marker above its resting position, increasing, and the MCP flexions, deg, of these."""
    model = build_model(anatomy)
    angles = np.radians([posture.get(name, 0.0) for name in ANGLES])
    number = ANGLES.index("index_mcp_flexion")
    heights, flexions = [], np.arange(70.0, -0.5, -1.0)
    for flexion in (posture["index_mcp_flexion"], *flexions):
        angles[number] = np.radians(flexion)
        heights.append(forward(model, HandPose(np.eye(4), angles.copy())).marker_centres[1, 2])
    return np.array(heights[1:]) - heights[0], flexions
