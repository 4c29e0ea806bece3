"""The measures of Rehg 1995, 4.3.5, of the 3-D mouse on the twin: a scripted hand, the twin's observations, a tracker.

The mouse gets the tracker's states only. The true hand serves to compute the errors.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.evaluation.data_sets import Watch
from rhot_app.latency import p50_p99
from rhot_app.mouse.pick_scene import Ball, PickScene
from rhot_app.mouse.play import MARKERS, MouseRun, SetUp, play
from rhot_app.mouse.pointer import BUTTONS, GROUND_M, MouseSettings, MouseState
from rhot_app.mouse.script import LEAD_S, Script
from rhot_app.mouse.target_test import EFFECTIVE, WIDTH_M, TargetTest
from rhot_app.simulator.scene.motion import Sway

Array = NDArray[np.float64]
Figures = dict[str, Any]

HUMAN_BITS_PER_S: Final = 3.7
"""bit/s: throughput of the scripted hand, the lower end of that of a mouse (Soukoreff and MacKenzie 2004)."""

TURNS_DEG: Final = (-60.0, -30.0, 0.0, 30.0, 60.0)
SPEEDS_M_PER_S: Final = (0.5, 1.0, 2.0, 3.0)
PEAK_TO_MEAN: Final = 1.875
"""Ratio of the peak speed to the mean speed of a minimum-jerk movement (Flash and Hogan 1985)."""

LOST_M: Final = 0.029
"""m: a hand is lost when the error of its wrist is larger: half the breadth of a wrist (resources/hands)."""

ORDINARY_SWAY: Final = Sway(position_mm=0.5, rotation_deg=0.3, angle_deg=0.3, tremor_mm=0.05)
"""Sway of a hand that rests on a table: a quarter of that of a hand held in the air (resources/motions/tap.json), with
the same tremor."""

SAME_PRESS_S: Final = 0.25
"""s: largest time between a tracked press and the true one it is matched with: half the interval of two clicks."""

_AXES: Final = "x_mm", "y_mm", "height_mm"
_CARRY_M: Final = 0.025  # radius of the ball that is picked and placed


def _rms(errors_m: Array) -> Figures | None:
    """Of errors (N, 3) m along the cursor's axes, in mm; None without any."""
    return _axes(np.sqrt(np.square(errors_m).mean(axis=0))) if len(errors_m) else None


def _axes(lengths_m: Array) -> Figures:
    """Lengths (3,) m along the cursor's axes, in mm."""
    return {name: 1e3 * float(value) for name, value in zip(_AXES, lengths_m, strict=True)}


def resolution(turn_deg: float, seed: int, **how: Any) -> Figures:
    """Jitter of the cursor of a motionless hand, turned by `turn_deg` on the table: standard deviation per axis, mm;
    None where it was not tracked."""
    script = Script(turn_deg=turn_deg)
    script.move((0.0, 0.0, 0.12), 0.5)
    begin_s = script.end_s + 0.5
    script.wait(3.5)
    run = play(script, seed, **how)
    still = run.during(begin_s, script.end_s)
    return {"turn_deg": turn_deg, "states": int(still.sum()), **(
        _axes(run.cursor[still].std(axis=0)) if still.any() else dict.fromkeys(_AXES))}


def coupling(seed: int, **how: Any) -> list[Figures]:
    """Error of the cursor while one degree of freedom alone is moved: `rms` and `peak` per axis, mm; None in a phase in
    which the hand was not tracked."""
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
    error = run.cursor - run.true_cursor
    figures = []
    for name, begin_s, end_s in phases:
        inside = run.during(begin_s, end_s)
        errors = error[inside] - error[inside][:1]
        figures.append({"moved": name, "rms": _rms(errors),
                        "peak": _axes(np.abs(errors).max(axis=0)) if len(errors) else None})
    return figures


def speed(metres_per_s: float, seed: int, **how: Any) -> Figures:
    """Part of the time in which a hand is tracked that moves to and fro on the table at this peak speed."""
    reach = 0.5 * GROUND_M[0] - 0.02
    way_s = PEAK_TO_MEAN * 2.0 * reach / MouseSettings().gain / metres_per_s
    script = Script()
    script.move((-reach, 0.0, 0.0), 0.6)
    for number in range(max(4, round(2.0 / way_s))):
        script.move((reach if number % 2 == 0 else -reach, 0.0, 0.0), way_s)
    run = play(script, seed, **how)
    palms = np.array([state.world_from_palm[:3, 3] for state in run.states])
    near = np.linalg.norm(palms - run.true_palm, axis=1) < LOST_M
    moving = run.times_s > LEAD_S + 0.6
    held = near & np.array([state.tracked for state in run.states])
    return {"speed_m_per_s": metres_per_s, "held": float(held[moving].mean())}


def latency(run: MouseRun) -> Figures | None:
    """Latency, ms: until the state is ready, and the lag of the cursor behind the hand at the state's own time, by the
    best-fitting shift. The first is None where no state was timed; None when the hand was not tracked."""
    inside = run.during(LEAD_S, run.script.end_s)
    if not inside.any():
        return None
    times, cursor, true = run.times_s[inside], run.cursor[inside], run.true_cursor[inside]
    shifts = np.arange(0.0, 0.1, 0.001)
    costs = [sum(np.square(np.interp(times - shift, times, true[:, k]) - cursor[:, k]).mean() for k in range(2))
               for shift in shifts]
    p50, p99 = (1e3 * float(value) if np.isfinite(value) else None for value in p50_p99(run.age_s[inside]))
    return {"ready_p50_ms": p50, "ready_p99_ms": p99,
            "lag_ms": abs(round(1e3 * float(shifts[int(np.argmin(costs))]), 1))}


def one_camera(seed: int, **how: Any) -> Figures:
    """Error of the cursor after the second camera is blocked, rms per axis, mm; None where the hand was not tracked.

    `free`: the palm moves anywhere. `on_table`: the palm slides on the table, as in Rehg's experiment with one camera.
    """
    script = Script()
    for place in ((0.15, 0.1, 0.1), (-0.15, -0.1, 0.0), (0.0, 0.12, 0.1)):
        script.move(place, 1.0)
        script.wait(0.4)
    figures: Figures = {}
    for name, on_table in (("free", False), ("on_table", True)):
        run = play(script, seed, settings=MouseSettings(on_table=on_table), blocked_s=LEAD_S, **how)
        inside = run.during(LEAD_S, script.end_s)
        figures[name] = _rms(run.cursor[inside] - run.true_cursor[inside])
    return figures


def buttons(seed: int, **how: Any) -> Figures:
    """Both buttons clicked in turn at random positions. `presses`: of the true hand; `right`: those that the tracked
    hand makes too; `wrong`: those that it makes alone; `late_ms`: median delay of the right ones."""
    rng, script = np.random.default_rng([seed, 0xB07]), Script()
    for number in range(8):
        script.move(_random_place(rng, 0.35 * np.array(GROUND_M)), 0.6)
        script.wait(0.3)
        script.click(BUTTONS[number % 2], 0.2)
    script.wait(0.4)
    run = play(script, seed, sway=ORDINARY_SWAY, **how)
    figures: Figures = {}
    for button in BUTTONS:
        true, found = (_presses(run, mouse, button) for mouse in (run.true_mouse, run.mouse))
        late = [float(found[k] - t_s) for t_s in true if len(found)
                for k in [int(np.argmin(np.abs(found - t_s)))] if abs(found[k] - t_s) < SAME_PRESS_S]
        figures[button] = {"presses": len(true), "right": len(late), "wrong": len(found) - len(late),
                           "late_ms": 1e3 * float(np.median(late)) if late else None}
    return figures


def _presses(run: MouseRun, mouse: list[MouseState], button: str) -> Array:
    """(K,) s: times at which a button was pressed."""
    down = np.array([one.is_pressed(button) for one in mouse], np.bool_)
    return np.asarray(run.times_s[1:][down[1:] & ~down[:-1]])


def target_script(seed: int) -> Script:
    """A hand that clicks all targets with the speed and the scatter of a person."""
    test, rng, script = TargetTest(), np.random.default_rng([seed, 0x411]), Script()
    bits = np.log2(np.linalg.norm(test.targets[test.order[1]] - test.targets[test.order[0]]) / WIDTH_M + 1.0)
    for number in test.order:
        x, y = test.targets[number] + rng.normal(0.0, WIDTH_M / EFFECTIVE, 2)
        script.move((float(x), float(y), 0.0), float(bits) / HUMAN_BITS_PER_S - 0.15, release=True)
        script.spread("thumb", out=True)
    script.wait(0.4)
    return script


def throughput(seed: int, **how: Any) -> tuple[Figures, MouseRun]:
    """The target test by the tracked hand and by the true one, and the run."""
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
    """Pick a ball at a random position and place it at another: whether it then lies within its radius, and its
    error."""
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


def measures(seed: int, places: int, *, set_up: SetUp = MARKERS, watch: Watch) -> Figures:
    """All measures in one set-up. Speeds are always measured with rendered images, because it is the detector that
    loses a fast hand."""
    how: dict[str, Any] = {"set_up": set_up, "watch": watch}
    figures: Figures = {"seed": seed, "set_up": set_up.name, "pictures": set_up.pictures or set_up.observe != "markers"}
    figures["speed"] = [speed(one, seed, **how | {"set_up": replace(set_up, pictures=True)}) for one in SPEEDS_M_PER_S]
    figures["coupling"] = coupling(seed, **how)
    figures["resolution"] = [resolution(turn, seed, **how) for turn in TURNS_DEG]
    figures["buttons"] = buttons(seed, **how)
    figures["throughput"], run = throughput(seed, **how)
    figures["latency"] = latency(run)
    if set_up.cameras > 1:
        figures["one_camera"] = one_camera(seed, **how)
    figures["place"] = [place_once(seed + k, **how) for k in range(places)]
    return figures


def report(set_ups: list[Figures]) -> str:
    """A table of each set-up with all measures, and a comparison of the set-ups."""
    parts = [_report(figures) for figures in set_ups]
    if len(set_ups) > 1:
        parts.append("\n".join(_comparison(set_ups)))
    return "\n\n\n".join(parts)


def _comparison(set_ups: list[Figures]) -> list[str]:
    """A line per measure, a column per set-up."""
    rows: list[tuple[str, list[str]]] = [("Beside each other", [one["set_up"] for one in set_ups])]
    for axis, name in (("x_mm", "right"), ("y_mm", "forward"), ("height_mm", "height")):
        rows.append((f"jitter, {name}, median [mm]", [_median([each[axis] for each in one["resolution"]])
                                                      for one in set_ups]))
    for axis, name in (("x_mm", "right"), ("y_mm", "forward"), ("height_mm", "height")):
        rows.append((f"error while moved, {name}, median rms [mm]", [
            _median([each["rms"] and each["rms"][axis] for each in one["coupling"]]) for one in set_ups]))
    for button in BUTTONS:
        rows.append((f"{button} button: right of presses, wrong", [
            "{right} of {presses}, {wrong}".format(**one["buttons"][button]) for one in set_ups]))
    rows.append(("target test [bit/s]", ["-" if one["throughput"]["tracked"] is None else
                                         f"{one['throughput']['tracked']['bits_per_s']:.2f}" for one in set_ups]))
    rows.append(("picked and placed", [f"{sum(each['placed'] for each in one['place'])} of {len(one['place'])}"
                                       for one in set_ups]))
    return [f"{name:<42}" + "".join(f"{value:>26}" for value in values) for name, values in rows]


def _median(values: list[float | None]) -> str:
    known = [value for value in values if value is not None]
    lost = len(values) - len(known)
    return ("-" if not known else f"{np.median(known):.1f}") + (f" ({lost} lost)" if lost else "")


def _report(figures: Figures) -> str:
    """The tables of one set-up."""
    source = "rendered images" if figures["pictures"] else "observations without images"
    found, place = figures["throughput"], figures["place"]
    late = figures["latency"]
    lines = [f"3-D mouse on the twin, {figures['set_up']}, seed {figures['seed']}, from {source}. Lengths are the "
             "cursor's.",
             "", "Hand speed along the table (always from images)      time in which the hand is held",
             *(f"  {one['speed_m_per_s']:5.2f} m/s {100.0 * one['held']:40.1f} %" for one in figures["speed"]),
             "", "Moved alone    error of the cursor [mm]: rms of right, forward, height; then their peaks",
             *(f"  {one['moved']:<12}{_three(one['rms'])}    {_three(one['peak'])}" for one in figures["coupling"]),
             "", "Palm turned on the table   jitter, standard deviation [mm]: right  forward  height",
             *(f"  {one['turn_deg']:+5.0f} deg{_three(one):>71}" for one in figures["resolution"]),
             "", "Button     presses   right   wrong   late [ms, median]",
             *(f"  {button:<10}{one['presses']:6}{one['right']:8}{one['wrong']:8}"
               + ("       -" if one["late_ms"] is None else f"{one['late_ms']:8.0f}")
               for button, one in figures["buttons"].items()),
             "", *_latency(late), "", *(_throughput(name, found[name]) for name in ("true", "tracked"))]
    single = figures.get("one_camera")
    if single is not None:
        lines += ["", "One camera covered     error of the cursor, rms [mm]: right  forward  height",
                  *(f"  {name:<21}{_three(single[key]):>50}" for name, key in (("palm anywhere", "free"),
                                                                               ("palm on the table", "on_table")))]
    if place:
        away = [one["away_mm"] for one in place]
        lines += ["", f"Pick and place: {sum(one['placed'] for one in place)} of {len(place)} balls came to lie within "
                      f"their radius of 25 mm; off by {np.median(away):.0f} mm (median), {max(away):.0f} mm at most."]
    return "\n".join(lines)


def _latency(one: Figures | None) -> list[str]:
    if one is None:
        return ["Latency: the hand was not tracked."]
    lag = f"The cursor lags {one['lag_ms']:.0f} ms behind the hand at the state's own time."
    if one["ready_p50_ms"] is None:
        return [lag]
    return [f"Latency: a state is ready {one['ready_p50_ms']:.1f} ms (p50), {one['ready_p99_ms']:.1f} ms (p99) after "
            "the hand was there.",
            lag]


def _three(one: Figures | None) -> str:
    if one is None or one["x_mm"] is None:
        return f"{'not tracked':>24}"
    return f"{one['x_mm']:8.2f} {one['y_mm']:8.2f} {one['height_mm']:7.2f}"


def _throughput(name: str, one: Figures | None) -> str:
    if one is None:
        return f"Target test, {name} hand: not every target was clicked."
    return (f"Target test, {name} hand: {one['bits_per_s']:.2f} bit/s, {one['movement_s']:.2f} s each, effective width "
            f"{one['effective_width_mm']:.1f} mm, {one['missed']} missed.")
