"""Trackers in trouble, side by side: the same raw logs of the twin, altered, through the classic and the estimator.

    python benchmarks/trackers.py [--only NAME ...] [--seeds 5] [--motion grasp] [--markers rhot6]
                                  [--sketched] [--json FILE]

Trials: `blind` and `silent` (one camera, for a second), `hidden` and `hidden-apart` (each marker 30 % of the time, from
all cameras at once or from each by itself), `mixed` (index and middle taken for each other 30 % of the time), `cross`
(fingers crossing for ten minutes), `wrist` (only the wrist's marker left), `still`, `ramp` and `fast` (spread and lag),
`turned` (a still hand, one camera turned otherwise than the rig says), `curve` (jitter against lag for several
filters), `scale` (a hand file 10 % wrong, the size floating), `start` (from nothing) and `compute` (time per datagram,
memory over ten minutes). Logs are kept and found again, as by `rhot evaluate compare`.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import msgspec
import numpy as np
import scenarios
from fault_injection import EPISODE_S
from numpy.typing import NDArray
from scenarios import Results, legend, run_table

from rhot_app.errors import RhotError
from rhot_app.estimation.se3 import exp_so3, quaternion_from_rotation, rotation_from_quaternion
from rhot_app.evaluation.accuracy import Figures
from rhot_app.evaluation.compare import TRACKERS
from rhot_app.evaluation.data_sets import DataSet, Order, data_set, data_sets_folder
from rhot_app.evaluation.track import rig_with
from rhot_app.hand.anthropometry import scaled_hand
from rhot_app.hand.skeleton import TIP_ROLES
from rhot_app.progress import ProgressLine
from rhot_app.project import FilterSettings, OneEuroSettings, Rig, TrackerSettings
from rhot_app.simulator.scene.scene import make_scene, twin_defaults

Array = NDArray[np.float64]

RAMP = str(Path(__file__).parent / "motions" / "ramp.json")
CROSS_S, STILL_S, START_EVERY_S, SCALE_S = 60.0, 12.0, 1.0, 40.0
LEAST_S = scenarios.BLIND_FROM_S + scenarios.BLIND_S
WRONG_SCALES = (1.1, 0.9)
TURNS_DEG = (0.0, 0.06, 0.2)
BETAS = (0.1, 0.4, 1.5, 8.0, 40.0)
POSITION_PER_PIXEL_BETA = 500.0  # the defaults' own proportion

OWN_TAKES: dict[str, tuple[str | None, float | None]] = {
    "cross": ("cross", CROSS_S), "still": ("still", STILL_S), "turned": ("still", STILL_S), "ramp": ("ramp", None),
    "fast": ("fast", None), "curve": ("still, ramp and fast", None), "scale": (None, SCALE_S),
    "start": ("rest, grasp and wave", None)}
"""Motion and seconds of trials that have their own; None: what is asked for."""


@dataclass(frozen=True)
class Bench:
    """What all trials share. `order` gives takes; `rigs` a rig per tracker for a take."""

    seeds: tuple[int, ...]
    seconds: float
    markers: str
    sketched: bool
    folder: Path
    minutes: float
    motion: str
    hidden_s: tuple[float, float]

    def about(self, trial: str) -> str:
        """What a trial was tried on, in words."""
        motion, seconds = OWN_TAKES.get(trial, (None, None))
        count = {"cross": self.crossings, "compute": 1}.get(trial, len(self.seeds))
        first, last = self.seeds[0], self.seeds[0] + count - 1
        return (f"{motion or Path(self.motion).name}, {seconds or self.seconds:g} s, "
                f"{f'seed {first}' if count == 1 else f'seeds {first} to {last}'}, {Path(self.markers).stem}, "
                f"{'sketched' if self.sketched else 'rendered'}")

    @property
    def crossings(self) -> int:
        """Takes of crossing fingers, a minute each."""
        return max(1, round(self.minutes))

    def takes(self, motion: str, seconds: float | None = None, seeds: Iterable[int] | None = None) -> Iterable[DataSet]:
        """One take per seed, filmed where it is not there yet."""
        settings = msgspec.structs.replace(twin_defaults(), markers=self.markers)
        for seed in self.seeds if seeds is None else seeds:
            order = Order(make_scene(settings, seed), motion, seconds or self.seconds, sketched=self.sketched)
            yield data_set(order, self.folder, lambda title: ProgressLine(f"filming {title}"),
                           anew=self.folder == data_sets_folder())

    def each(self, takes: Iterable[DataSet], trial: Callable[[DataSet, Rig], Figures],
             trackers: dict[str, TrackerSettings] = TRACKERS) -> Results:
        """A trial on every take with every tracker, the takes' figures together."""
        runs: dict[str, list[Figures]] = {name: [] for name in trackers}
        for one in takes:
            for name, settings in trackers.items():
                runs[name].append(trial(one, rig_with(one.rig, settings)))
        return {name: scenarios.gather(figures) for name, figures in runs.items()}


def blind(bench: Bench, *, says_so: bool) -> Results:
    """One camera, for a second, of a movement."""
    return bench.each(bench.takes(bench.motion), partial(scenarios.one_camera_blind, says_so=says_so))


def hidden(bench: Bench, *, together: bool) -> Results:
    """Each marker 30 % of the time."""
    return bench.each(bench.takes(bench.motion), partial(scenarios.markers_hidden, share=0.3, together=together,
                                                         lasting_s=bench.hidden_s))


def mixed(bench: Bench) -> Results:
    """Index and middle finger wear one colour."""
    def trial(one: DataSet, rig: Rig) -> Figures:
        roles = [marker.role for marker in rig.markers.markers]
        pair = roles.index(TIP_ROLES[1]), roles.index(TIP_ROLES[2])
        return scenarios.names_mixed_up(one, rig, pair=pair, share=0.3)
    return bench.each(bench.takes(bench.motion), trial)


def cross(bench: Bench) -> Results:
    """Minutes of crossing fingers, each minute with a seed of its own."""
    seeds = range(bench.seeds[0], bench.seeds[0] + bench.crossings)
    return bench.each(bench.takes("cross", CROSS_S, seeds), scenarios.plain)


def curve(bench: Bench) -> Results:
    """Spread of a still hand against lag on the ramp and in haste: 1-euro filters and the trackers as they are."""
    stills, ramps, hasty = (list(bench.takes(motion)) for motion in ("still", RAMP, "fast"))
    results: Results = {}
    for name, change in _variants().items():
        parts = [scenarios.gather([trial(one, change(one.rig)) for one in takes]) for takes, trial in (
            (stills, scenarios.standing_still), (ramps, partial(scenarios.lagging, speeding_up=True)),
            (hasty, partial(scenarios.lagging, speeding_up=False)))]
        results[name] = {"still_sd_mm": parts[0]["sd_mm"], "ramp_lag_ms": parts[1]["lag_ms"],
                         "ramp_tips_mm": parts[1]["tips_mm"], "fast_lag_ms": parts[2]["lag_ms"],
                         "fast_tips_mm": parts[2]["tips_mm"]}
    return results


def scale(bench: Bench) -> Results:
    """A hand file 10 % too long and too short, corrected while a hand moves."""
    floating = {name: msgspec.structs.replace(settings, float_scale=True) for name, settings in TRACKERS.items()
                if settings.kind == "estimator"}
    results: Results = {}
    for wrong in WRONG_SCALES:
        def trial(one: DataSet, rig: Rig, wrong: float = wrong) -> Figures:
            other = msgspec.structs.replace(rig, hand=scaled_hand(rig.hand, wrong))
            return scenarios.growing(one, other, 1.0 / wrong)
        for name, figures in bench.each(bench.takes(bench.motion, SCALE_S), trial, floating).items():
            results[f"{name}, hand x {wrong:g}"] = figures
    return results


def turned(bench: Bench) -> Results:
    """A still hand, when the rig is mistaken about how its second camera is turned: up or down, towards the first one,
    about its line of sight."""
    results: Results = {}
    for axis, name in enumerate(("tilt", "yaw", "roll")):
        for turn_deg in TURNS_DEG[axis > 0:]:
            trial = partial(_mistaken, turn=np.radians(turn_deg) * np.eye(3)[axis])
            for tracker, figures in bench.each(bench.takes("still", STILL_S), trial).items():
                results[f"{tracker}, {name} {turn_deg:g} deg" if turn_deg else f"{tracker}, exact"] = figures
    return results


def _mistaken(take: DataSet, rig: Rig, turn: Array) -> Figures:
    """Spread and errors with the second camera turned by a rotation vector (3,) rad about its own axes, and a rig that
    does not say how well it was calibrated."""
    pose = rig.nodes[1].pose
    quaternion = quaternion_from_rotation(exp_so3(turn) @ rotation_from_quaternion(pose.rotation_wxyz))
    other = msgspec.structs.replace(pose, rotation_wxyz=tuple(quaternion.tolist()))
    second = msgspec.structs.replace(rig.nodes[1], pose=other)
    mistaken = msgspec.structs.replace(rig, nodes=(rig.nodes[0], second, *rig.nodes[2:]), calibration=None)
    return scenarios.standing_still(take, mistaken) | scenarios.plain(take, mistaken)


def start(bench: Bench) -> Results:
    """Datagrams that begin in the middle of a movement."""
    starts: list[float] = np.arange(0.0, bench.seconds - 1.0, START_EVERY_S).tolist()
    results: Results = {}
    takes = [one for motion in ("rest", "grasp", "wave") for one in bench.takes(motion)]
    for name, settings in TRACKERS.items():
        found = [after for one in takes for after in scenarios.starting(one, rig_with(one.rig, settings), starts)]
        known = [after for after in found if after is not None]
        results[name] = {"median_s": float(np.median(known)) if known else None,
                         "p95_s": float(np.percentile(known, 95.0)) if known else None,
                         "max_s": max(known, default=None), "never": float(len(found) - len(known)),
                         "starts": float(len(found))}
    return results


def compute(bench: Bench) -> Results:
    """Time per datagram, and memory."""
    first = next(iter(bench.takes(bench.motion)))
    return bench.each([first], partial(scenarios.computing, minutes=bench.minutes))


TRIALS: dict[str, Callable[[Bench], Results]] = {
    "blind": partial(blind, says_so=True), "silent": partial(blind, says_so=False),
    "hidden": partial(hidden, together=True), "hidden-apart": partial(hidden, together=False), "mixed": mixed,
    "cross": cross, "wrist": lambda bench: bench.each(bench.takes(bench.motion), scenarios.wrist_alone),
    "still": lambda bench: bench.each(bench.takes("still", STILL_S), scenarios.standing_still),
    "ramp": lambda bench: bench.each(bench.takes(RAMP), partial(scenarios.lagging, speeding_up=True)),
    "fast": lambda bench: bench.each(bench.takes("fast"), partial(scenarios.lagging, speeding_up=False)),
    "turned": turned, "curve": curve, "scale": scale, "start": start, "compute": compute,
}


def main() -> int:
    """Run the trials, print a table of each as it is done, write JSON."""
    parser = argparse.ArgumentParser(description="The classic and the estimator in trouble, on the same raw logs.")
    parser.add_argument("--only", nargs="+", metavar="NAME", choices=tuple(TRIALS), default=tuple(TRIALS),
                        help=f"trials: {', '.join(TRIALS)}")
    parser.add_argument("--seeds", type=int, default=5, help="how many people, cameras and motions (default 5)")
    parser.add_argument("--seed", type=int, default=1, help="the first one")
    parser.add_argument("--seconds", type=float, default=8.0, help="length of a take (default 8)")
    parser.add_argument("--motion", default="grasp", help="of the trials that need none of their own (default grasp)")
    parser.add_argument("--markers", "--marker-set", default="rhot6", metavar="SET",
                        help="one of resources/markers, or a marker file, .json (default rhot6)")
    parser.add_argument("--minutes", type=float, default=10.0, help="of crossing, and of computing (default 10)")
    parser.add_argument("--hidden-for", type=float, nargs=2, metavar=("MIN", "MAX"), default=EPISODE_S,
                        help=f"s, how long markers stay hidden at a time (default {EPISODE_S[0]} to {EPISODE_S[1]})")
    parser.add_argument("--sketched", action="store_true", help="logs without pictures")
    parser.add_argument("--logs", type=Path, metavar="DIR", default=data_sets_folder(),
                        help="where the logs are kept, and found again")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all figures there")
    args = parser.parse_args()
    if args.seeds < 1:
        parser.error(f"--seeds {args.seeds}: must be 1 or more")
    if args.seed < 0:
        parser.error(f"--seed {args.seed}: must be 0 or more")
    if not LEAST_S <= args.seconds < float("inf"):
        parser.error(f"--seconds {args.seconds}: must be {LEAST_S:g} or more, for a camera to be covered for a second, "
                     "and have an end")
    if not 0.0 < args.minutes < float("inf"):
        parser.error(f"--minutes {args.minutes}: must be more than 0, and end")
    if not 0.001 <= args.hidden_for[0] <= args.hidden_for[1] <= args.seconds:
        parser.error("--hidden-for must be 0.001 s or more, the shorter time first, and within --seconds")
    try:
        args.logs.mkdir(parents=True, exist_ok=True)
    except OSError as exc:
        parser.error(f"--logs {args.logs}: logs cannot be kept there ({exc.strerror}); choose another folder")
    if args.json is not None and not _writable(args.json):
        parser.error(f"--json {args.json}: figures cannot be written there; choose another file")
    bench = Bench(tuple(range(args.seed, args.seed + args.seeds)), args.seconds, args.markers, args.sketched, args.logs,
                  args.minutes, args.motion, tuple(args.hidden_for))
    done: dict[str, Results] = {}
    for name in args.only:
        try:
            done[name] = TRIALS[name](bench)
        except RhotError as exc:
            print(f"{name}: {exc}", file=sys.stderr)
            continue
        print(run_table(name, bench.about(name), done[name]), flush=True)
        if args.json is not None:
            args.json.write_text(json.dumps(done, indent=1) + "\n")
    print(legend(done.values()))
    return 0 if len(done) == len(args.only) else 2


def _writable(path: Path) -> bool:
    """Whether a file can be written there; none is made yet."""
    return os.access(path if path.exists() else path.parent, os.W_OK) and not path.is_dir()


def _variants() -> Mapping[str, Callable[[Rig], Rig]]:
    """Ways to filter: the classic tracker's 1-euro filters from calm to prompt, then every tracker as it is."""
    def classic(rig: Rig, beta: float) -> Rig:
        pixel = OneEuroSettings(min_cutoff_hz=1.0, beta=beta, derivative_cutoff_hz=15.0)
        position = OneEuroSettings(min_cutoff_hz=1.0, beta=POSITION_PER_PIXEL_BETA * beta, derivative_cutoff_hz=15.0)
        filtered = msgspec.structs.replace(rig, filters=FilterSettings(pixel=pixel, position=position))
        return rig_with(filtered, TrackerSettings(kind="classic"))
    return {f"1-euro, beta {beta:g}": partial(classic, beta=beta) for beta in BETAS} | {
        name: partial(rig_with, settings=settings) for name, settings in TRACKERS.items()}


if __name__ == "__main__":
    sys.exit(main())
