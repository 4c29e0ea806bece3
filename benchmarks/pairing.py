"""What pairing by time is worth: three ways to bring two unsynchronised rolling-shutter cameras together.

Markers' image positions are exact, filters are off; what remains is the error of the pairing alone.
``python benchmarks/pairing.py [--seconds S] [--json FILE]`` prints a table of marker errors, mm rms.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "tracking"))

from synthetic_rig import FAST, WIDE, Preset, Sight, compare, hand_trajectory, make_rig, observe, run

from rhot_app.project import FilterSettings, Rig
from rhot_app.tracking import tracks
from rhot_app.tracking.make import make_tracker
from rhot_app.tracking.tracker import CameraObservations

Array = NDArray[Any]

MOTIONS = ("rest", "grasp", "pinch", "wave", "fast")
PRESETS: dict[str, tuple[Preset, float]] = {"wide": (WIDE, 0.6), "fast": (FAST, 1.0)}


def by_arrival(frames: list[CameraObservations]) -> Iterator[CameraObservations]:
    """What a tracker without clocks sees: the two newest frames, taken as simultaneous, the later one's time."""
    newest: dict[int, CameraObservations] = {}
    for observations in frames:
        newest[observations.camera] = observations
        if len(newest) == 2:
            t_ns = max(held.t_row0_master_ns for held in newest.values())
            for held in newest.values():
                yield dataclasses.replace(held, t_row0_master_ns=t_ns, row_time_ns=0, t_receive_ns=t_ns)
            newest.clear()


def measure(rig: Rig, motion: str, preset: Preset, distance_m: float, seconds: float) -> dict[str, float]:
    """Marker error, mm rms, of each way."""
    trajectory = hand_trajectory(rig, motion, seconds, distance_m)
    frames = observe(rig, preset, trajectory, seconds, Sight(noise_px=0.0))

    figures = {"by arrival": compare(rig, run(make_tracker(rig), list(by_arrival(frames))), trajectory).raw_mm}
    with patch.object(tracks, "interpolate_all", interpolate_by_lines):
        figures["by time, lines"] = compare(rig, run(make_tracker(rig), frames), trajectory).raw_mm
    figures["by time, cubics"] = compare(rig, run(make_tracker(rig), frames), trajectory).raw_mm
    return figures


def interpolate_by_lines(times: Array, pixels: Array, covariances: Array, _flags: Array, counts: Array, t_ns: int,
                         out_pixels: Array, out_covariances: Array, out_flags: Array) -> None:
    """In place of `tracks.interpolate_all`: straight lines between neighbouring samples."""
    for c, m in np.ndindex(*counts.shape):
        held = slice(0, counts[c, m])
        track = times[c, m, held]
        out_flags[c, m] = -1
        out_pixels[c, m] = np.nan
        out_covariances[c, m] = np.nan
        if len(track) and track[0] <= t_ns <= track[-1]:
            out_flags[c, m] = 0
            out_covariances[c, m] = covariances[c, m, 0]
            out_pixels[c, m] = [np.interp(float(t_ns - track[0]), (track - track[0]).astype(float), values)
                                for values in pixels[c, m, held].T]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    table: dict[str, dict[str, dict[str, float]]] = {}
    for name, (preset, distance_m) in PRESETS.items():
        rig = make_rig(preset, filters=FilterSettings(enabled=False))
        print(f"{name}: {preset.fps:g} fps, row time {preset.row_time_ns / 1000:g} µs, {distance_m:g} m, mm rms")
        table[name] = {motion: measure(rig, motion, preset, distance_m, options.seconds) for motion in MOTIONS}
        for motion, figures in table[name].items():
            print(f"  {motion:6}", *(f"{way}: {value:7.3f}" for way, value in figures.items()), sep="   ")
    if options.json:
        options.json.write_text(json.dumps(table, indent=2) + "\n")


if __name__ == "__main__":
    main()
