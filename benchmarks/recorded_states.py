"""The states that every tracker makes of recorded logs, kept and compared: a redesign of the core keeps them.

    python benchmarks/recorded_states.py keep FOLDER       # before it
    python benchmarks/recorded_states.py compare FOLDER    # after it

FOLDER has raw logs (`*.rhotlog`), of any motions, markers, landmarks, objects, contours, one hand or two. `keep` writes
beside each what the rig's own tracker, the classic one, the estimator and the smoother make of it, as far as its rig
allows. `compare` tracks them again and prints by how much places differ. Exit code 1: by more than 1e-6 m, or a state's
condition differs. Truth is not asked: where states differ, `rhot evaluate compare` says which are better.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from tables import arguments, publish, table

from rhot_app.engine.offline.replay_summary import replay_states
from rhot_app.errors import RecordingError, RhotError
from rhot_app.project import Rig
from rhot_app.recording.raw_log import LogReader
from rhot_app.sources.replay import LogValidator
from rhot_app.state import HandState
from rhot_app.tracking.scene import make_tracker

SAME_M = 1e-6
TRACKERS = "own", "classic", "estimator", "smoothed"


def rig_for(rig: Rig, tracker: str) -> Rig:
    """The rig that asks for a tracker."""
    if tracker == "own":
        return rig
    kind = "classic" if tracker == "classic" else "estimator"
    return msgspec.structs.replace(rig, tracker=msgspec.structs.replace(rig.tracker, kind=kind))


def states_of(log: Path, tracker: str) -> Iterator[HandState]:
    """The states of a log. Raises RhotError or ValueError where its rig cannot have this tracker."""
    with contextlib.closing(LogReader(log)) as reader:
        rig = rig_for(reader.rig, tracker)
        validator = LogValidator(rig)
        if tracker == "smoothed" and not rig.tracker.smooths:
            raise RecordingError("this rig's tracker does not smooth")
        yield from replay_states(reader, validator, make_tracker(rig, smooth=tracker == "smoothed"))


def columns(states: list[HandState]) -> dict[str, Any]:
    """What is compared: times, conditions, and all places, of both hands and of objects."""
    found: dict[str, Any] = {
        "t_ns": np.array([one.t_master_ns for one in states]),
        "condition": np.array([one.condition.name for one in states]),
        "joints": np.array([one.joint_positions for one in states]),
        "tips": np.array([one.fingertip_positions for one in states]),
        "markers": np.array([one.marker_positions for one in states])}
    if any(one.other is not None for one in states):
        found["other"] = np.array([np.full((21, 3), np.nan) if one.other is None else one.other.joint_positions
                                   for one in states])
    if any(one.objects for one in states):
        found["objects"] = np.array([[each.world_from_object[:3, 3] for each in one.objects] for one in states])
    return found


def difference(then: dict[str, Any], now: dict[str, Any]) -> tuple[int, float, int]:
    """States that one of them lacks; the largest distance of a place that both have, m, infinite where one of them has
    none; and how many conditions differ."""
    both = np.intersect1d(then["t_ns"], now["t_ns"])
    if len(then["t_ns"]) != len(now["t_ns"]) or len(both) != len(np.unique(then["t_ns"])):
        return abs(len(then["t_ns"]) - len(now["t_ns"])) or 1, np.inf, 0
    most = 0.0
    for name in set(then) - {"t_ns", "condition"}:
        if name not in now or np.any(np.isnan(then[name]) != np.isnan(now[name])):
            return 0, np.inf, int(np.sum(then["condition"] != now["condition"]))
        most = max(most, float(np.nanmax(np.abs(then[name] - now[name]), initial=0.0)))
    return 0, most, int(np.sum(then["condition"] != now["condition"]))


def main() -> int:
    """Keep, or compare and print the table."""
    parser = arguments(__doc__)
    parser.add_argument("what", choices=("keep", "compare"))
    parser.add_argument("folder", type=Path)
    args = parser.parse_args()
    rows, good = [], True
    for log in sorted(args.folder.glob("*.rhotlog")):
        for tracker in TRACKERS:
            kept = log.with_suffix(f".{tracker}.npz")
            try:
                now = columns(list(states_of(log, tracker)))
            except (RhotError, ValueError) as error:
                print(f"{log.name}, {tracker}: {error}", file=sys.stderr)
                continue
            if args.what == "keep":
                np.savez_compressed(kept, **now)
                rows.append([log.stem, tracker, len(now["t_ns"]), float(np.mean(now["condition"] == "TRACKING"))])
                continue
            with np.load(kept) as file:
                lacking, most, conditions = difference(dict(file), now)
            good &= not lacking and most <= SAME_M and not conditions
            rows.append([log.stem, tracker, len(now["t_ns"]), lacking, most, conditions])
    head = ["log", "tracker", "states"]
    head += ["TRACKING"] if args.what == "keep" else ["lacking", "largest difference, m", "conditions that differ"]
    publish(args, {args.what: rows}, table(head, rows))
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
