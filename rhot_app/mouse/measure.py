"""The measures of Rehg 1995, 4.3.5, of the 3-D mouse on the twin: a scripted hand, the twin's observations, a tracker.

The truth scripts the hand and judges what came of it; the mouse gets the tracker's states alone.
"""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.engine.offline.replay_summary import replay_states
from rhot_app.engine.pipeline import warm_up
from rhot_app.evaluation.data_sets import Order, Watch, data_set, data_sets_folder
from rhot_app.evaluation.track import Timed
from rhot_app.hand.skeleton import TIP_ROLES
from rhot_app.mouse.pick_scene import Ball, PickScene
from rhot_app.mouse.pointer import GROUND_M, Mouse, MouseSettings, MouseState
from rhot_app.mouse.script import LEAD_S, Script, motion_file
from rhot_app.mouse.target_test import EFFECTIVE, WIDTH_M, TargetTest
from rhot_app.project import Rig, with_tracker
from rhot_app.recording.raw_log import RecordKind
from rhot_app.simulator.film.node_log import T0_MASTER_NS
from rhot_app.simulator.film.truth import Truth
from rhot_app.simulator.scene.motion import Sway
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.sources.replay import LogValidator
from rhot_app.state import Condition, HandState, Knowledge
from rhot_app.tracking.trackers import make_tracker
from rhot_node.files import write_document

Array = NDArray[np.float64]
Figures = dict[str, Any]

HUMAN_BITS_PER_S: Final = 3.7
"""The scripted hand's own throughput: a mouse's, at its lower end (Soukoreff and MacKenzie 2004)."""

TURNS_DEG: Final = (-60.0, -30.0, 0.0, 30.0, 60.0)
SPEEDS_M_PER_S: Final = (0.5, 1.0, 2.0, 3.0)
PEAK: Final = 1.875
"""Peak speed of a way of minimum jerk, in its mean speed."""

HELD_M: Final = 0.029
"""A hand is lost when its wrist is off by more: half the breadth of a wrist (resources/hands)."""

ORDINARY_SWAY: Final = Sway(position_mm=0.5, rotation_deg=0.3, angle_deg=0.3, tremor_mm=0.05)
"""Of a hand that rests on a table: a quarter of one held in the air (resources/motions/tap.json), with its tremor."""

_AXES: Final = "x_mm", "y_mm", "height_mm"
_KEY_S: Final = 0.01  # for ways of a tenth of a second
_CARRY_M: Final = 0.025  # radius of the ball that is picked and placed


@dataclass(frozen=True, slots=True)
class MouseRun:
    """One script through the pipeline. N states of the tracker; `mouse` and `true_mouse` are what the mouse makes of
    them and of the true hand. `times_s` (N,): scene times. `age_s` (N,): until a state was ready."""

    script: Script
    times_s: Array
    states: list[HandState]
    mouse: list[MouseState]
    true_mouse: list[MouseState]
    true_palm: Array  # (N, 3) m
    age_s: Array

    @property
    def cursor(self) -> Array:
        """(N, 3) m, NaN before the rest."""
        return _cursors(self.mouse)

    @property
    def true_cursor(self) -> Array:
        """(N, 3) m, of the true hand."""
        return _cursors(self.true_mouse)

    def during(self, begin_s: float, end_s: float) -> NDArray[np.bool_]:
        """Mask (N,) of the states between two scene times at which both cursors are there."""
        there = np.isfinite(self.cursor).all(axis=1) & np.isfinite(self.true_cursor).all(axis=1)
        return np.asarray((self.times_s >= begin_s) & (self.times_s <= end_s) & there)


def play(script: Script, seed: int, *, settings: MouseSettings | None = None, pictures: bool = False,
         sway: Sway | None = None, covered_s: float = math.inf, watch: Watch = lambda title: None) -> MouseRun:
    """Play a script to the twin and its states to the mouse. `pictures`: render and detect; else the observations are
    made without pictures (`rhot_app.simulator.film.ideal_observations`). From `covered_s` on the second camera is
    silent. Raises RhotError."""
    settings, scene = settings or MouseSettings(), make_scene(twin_defaults(), seed)
    with tempfile.TemporaryDirectory(prefix="rhot-mouse-") as name:
        path = Path(name) / "mouse.json"
        write_document(path, motion_file(script, scene.hand, settings, sway or Sway(), key_s=_KEY_S))
        order = Order(scene, str(path), script.end_s, sketched=not pictures)
        data = data_set(order, data_sets_folder() if pictures else Path(name) / "sets", watch)
        truth, second = data.truth, data.rig.nodes[1].node_id
        records = [one for one in data.records() if one.node_id != second or one.kind is not RecordKind.DATAGRAM
                   or 1e-9 * (one.t_master_ns - T0_MASTER_NS) < covered_s]
    rig = with_tracker(data.rig, "estimator")
    tracker = make_tracker(rig)
    warm_up(tracker, rig)
    timed = Timed(records)
    states = list(replay_states(timed, LogValidator(rig), tracker))
    return _run(script, states, truth, rig, settings, float(np.median(timed.compute_s)))


def _run(script: Script, states: list[HandState], truth: Truth, rig: Rig, settings: MouseSettings,
         compute_s: float) -> MouseRun:
    times = 1e-9 * np.array([state.t_master_ns - T0_MASTER_NS for state in states])
    ready = 1e-9 * np.array([state.t_receive_ns - T0_MASTER_NS for state in states]) + compute_s
    mouse, true_mouse = Mouse(settings), Mouse(settings)
    return MouseRun(script, times, states, [mouse.feed(state) for state in states],
                    [true_mouse.feed(state) for state in _true_states(states, truth, rig, times)],
                    truth.palm_at(times)[:, :3, 3], ready - times)


def _true_states(states: list[HandState], truth: Truth, rig: Rig, times_s: Array) -> list[HandState]:
    """The same instants with the true hand, all of it measured."""
    roles = [marker.role for marker in rig.markers.markers]
    tips = truth.markers_at(times_s)[:, [roles.index(role) for role in TIP_ROLES]]
    measured = np.full(21, Knowledge.MEASURED, np.uint8)
    return [replace(state, condition=Condition.TRACKING, world_from_palm=palm, palm_knowledge=Knowledge.MEASURED,
                    palm_covariance=np.zeros((6, 6)), joint_positions=joints, joint_knowledge=measured,
                    fingertip_positions=tip, fingertip_covariances=np.zeros((5, 3, 3)))
            for state, palm, joints, tip in zip(states, truth.palm_at(times_s), truth.joints_at(times_s), tips,
                                                strict=True)]


def _cursors(mouse: list[MouseState]) -> Array:
    return np.array([np.full(3, np.nan) if one.cursor is None else one.cursor for one in mouse])


def _rms(errors_m: Array) -> Figures | None:
    """Of errors (N, 3) m along the cursor's axes, in mm; None without any."""
    return _axes(np.sqrt(np.square(errors_m).mean(axis=0))) if len(errors_m) else None


def _axes(lengths_m: Array) -> Figures:
    """Lengths (3,) m along the cursor's axes, in mm."""
    return {name: 1e3 * float(value) for name, value in zip(_AXES, lengths_m, strict=True)}


# -- resolution, coupling, speed, latency (4.3.5) ----------------------------------------------------------------------

def resolution(turn_deg: float, seed: int, **how: Any) -> Figures:
    """Jitter of the cursor of a motionless hand that is turned on the table: standard deviation per axis, mm; None
    where it was not tracked."""
    script = Script(turn_deg=turn_deg)
    script.move((0.0, 0.0, 0.12), 0.5)
    begin_s = script.end_s + 0.5
    script.wait(3.5)
    run = play(script, seed, **how)
    still = run.during(begin_s, script.end_s)
    return {"turn_deg": turn_deg, "states": int(still.sum()), **(
        _axes(run.cursor[still].std(axis=0)) if still.any() else dict.fromkeys(_AXES))}


def coupling(seed: int, **how: Any) -> list[Figures]:
    """How far the cursor errs from the true hand's while one degree of freedom alone is moved: `rms` and `peak` per
    axis, mm; None in a phase in which the hand was not tracked."""
    script = Script()
    script.move((0.0, 0.0, 0.08), 0.5)
    phases = []
    for name, away in (("right", (0.12, 0.0, 0.08)), ("forward", (0.0, 0.12, 0.08)), ("height", (0.0, 0.0, 0.18))):
        script.wait(0.4)
        begin_s = script.end_s
        script.move(away, 0.6)
        script.move((0.0, 0.0, 0.08), 0.6)
        phases.append((name, begin_s, script.end_s))
    for button in ("thumb", "little"):
        script.wait(0.4)
        begin_s = script.end_s
        script.click(button, 0.3)
        script.wait(0.2)
        phases.append((button, begin_s, script.end_s))
    run = play(script, seed, **how)
    off = run.cursor - run.true_cursor
    figures = []
    for name, begin_s, end_s in phases:
        inside = run.during(begin_s, end_s)
        errors = off[inside] - off[inside][:1]
        figures.append({"moved": name, "rms": _rms(errors),
                        "peak": _axes(np.abs(errors).max(axis=0)) if len(errors) else None})
    return figures


def speed(metres_per_s: float, seed: int, **how: Any) -> Figures:
    """How much of the time a hand is held that goes to and fro on the table with such a peak speed."""
    reach = 0.5 * GROUND_M[0] - 0.02
    way_s = PEAK * 2.0 * reach / MouseSettings().gain / metres_per_s
    script = Script()
    script.move((-reach, 0.0, 0.0), 0.6)
    for number in range(max(4, round(2.0 / way_s))):
        script.move((reach if number % 2 == 0 else -reach, 0.0, 0.0), way_s)
    run = play(script, seed, **how)
    palms = np.array([state.world_from_palm[:3, 3] for state in run.states])
    near = np.linalg.norm(palms - run.true_palm, axis=1) < HELD_M
    moving = run.times_s > LEAD_S + 0.6
    held = near & np.array([state.tracked for state in run.states])
    return {"speed_m_per_s": metres_per_s, "held": float(held[moving].mean())}


def latency(run: MouseRun) -> Figures | None:
    """From the hand to the cursor: until the state is ready, and how far the cursor lags behind the hand at the state's
    own time, by the shift that fits best; ms. None when the hand was not tracked."""
    inside = run.during(LEAD_S, run.script.end_s)
    if not inside.any():
        return None
    times, cursor, true = run.times_s[inside], run.cursor[inside], run.true_cursor[inside]
    shifts = np.arange(0.0, 0.1, 0.001)
    misfits = [sum(np.square(np.interp(times - shift, times, true[:, k]) - cursor[:, k]).mean() for k in range(2))
               for shift in shifts]
    ready = 1e3 * np.percentile(run.age_s[inside], [50, 99])
    return {"ready_p50_ms": float(ready[0]), "ready_p99_ms": float(ready[1]),
            "lag_ms": abs(round(1e3 * float(shifts[int(np.argmin(misfits))]), 1))}


def one_camera(seed: int, **how: Any) -> Figures:
    """Error of the cursor once the second camera is covered, rms per axis, mm: with the palm anywhere, and with it on
    the table as in Rehg's experiment with one camera; None where it was not tracked."""
    script = Script()
    for place in ((0.15, 0.1, 0.1), (-0.15, -0.1, 0.0), (0.0, 0.12, 0.1)):
        script.move(place, 1.0)
        script.wait(0.4)
    figures: Figures = {}
    for name, on_table in (("free", False), ("on_table", True)):
        run = play(script, seed, settings=MouseSettings(on_table=on_table), covered_s=LEAD_S, **how)
        inside = run.during(LEAD_S, script.end_s)
        figures[name] = _rms(run.cursor[inside] - run.true_cursor[inside])
    return figures


# -- target test and pick and place ------------------------------------------------------------------------------------

def target_script(seed: int) -> Script:
    """A hand that clicks all targets, as fast and as scattered as a person."""
    test, rng, script = TargetTest(), np.random.default_rng([seed, 0x411]), Script()
    bits = np.log2(np.linalg.norm(test.targets[test.order[1]] - test.targets[test.order[0]]) / WIDTH_M + 1.0)
    for number in test.order:
        x, y = test.targets[number] + rng.normal(0.0, WIDTH_M / EFFECTIVE, 2)
        script.move((float(x), float(y), 0.0), float(bits) / HUMAN_BITS_PER_S - 0.15, release=True)
        script.spread("thumb", out=True)
    script.wait(0.4)
    return script


def throughput(seed: int, **how: Any) -> tuple[Figures, MouseRun]:
    """The target test by the tracked hand, and by the true one."""
    run = play(target_script(seed), seed, **how)
    figures: Figures = {}
    for name, mouse in (("tracked", run.mouse), ("true", run.true_mouse)):
        test = TargetTest()
        for state in mouse:
            test.feed(state)
        found = test.result()
        figures[name] = None if found is None else {
            "bits_per_s": found.bits_per_s, "movement_s": found.movement_s, "missed": found.missed,
            "effective_width_mm": 1e3 * found.effective_width_m}
    return figures, run


def place_once(seed: int, **how: Any) -> Figures:
    """Pick a ball at a random place and put it at another: whether it lies within its radius then, and how far off."""
    rng = np.random.default_rng([seed, 0x91C])
    half = 0.35 * np.array(GROUND_M)
    start, end = (_random_place(rng, half) for _ in range(2))
    script = Script()
    script.move(start, 1.0)
    script.wait(0.3)
    script.spread("thumb", out=True)
    script.wait(0.3)
    script.move(end, 1.0)
    script.wait(0.3)
    script.spread("thumb", out=False)
    script.wait(0.6)
    scene = PickScene((Ball("ball", start, _CARRY_M, (213, 94, 0)),))
    run = play(script, seed, sway=ORDINARY_SWAY, **how)
    picked = False
    for state in run.mouse:
        scene.feed(state)
        picked |= scene.held is not None
    away = float(np.linalg.norm(np.array(scene.balls[0].centre) - np.array(end)))
    return {"seed": seed, "picked": picked, "away_mm": 1e3 * away,
            "placed": picked and scene.held is None and away <= _CARRY_M}


def _random_place(rng: np.random.Generator, half: Array) -> tuple[float, float, float]:
    x, y = rng.uniform(-half, half)
    return float(x), float(y), float(rng.uniform(_CARRY_M, 0.12))


def measures(seed: int, places: int, *, pictures: bool, watch: Watch) -> Figures:
    """All of it. The speeds are always from pictures, because it is the detector that loses a fast hand."""
    how = {"pictures": pictures, "watch": watch}
    figures: Figures = {"seed": seed, "pictures": pictures}
    figures["speed"] = [speed(one, seed, pictures=True, watch=watch) for one in SPEEDS_M_PER_S]
    figures["coupling"] = coupling(seed, **how)
    figures["resolution"] = [resolution(turn, seed, **how) for turn in TURNS_DEG]
    figures["throughput"], run = throughput(seed, **how)
    figures["latency"] = latency(run)
    figures["one_camera"] = one_camera(seed, **how)
    figures["place"] = [place_once(seed + k, **how) for k in range(places)]
    return figures
