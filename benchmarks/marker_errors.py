"""How wrong the image positions of nodes are, beside what they state: px per axis, against the twin's truth.

    python benchmarks/marker_errors.py [--seeds 3] [--motions rest,wave,grasp,pinch,fast] [--sketched]

The takes of `rhot evaluate compare`, observations without flags only. `common` is what both cameras see alike: half
the sum of two observations nearest in time; `own` is each camera's alone: half their difference, rms of one camera.
`share` is own squared in parts of the stated variance; constants of `tracking/markers/marker_model.py` and
`tracking/markers/marker_residual.py` rest on it. `lasts`: correlation of own errors 0.1 s apart, 0 for noise.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tables import arguments, publish, table

from rhot_app.errors import RhotError
from rhot_app.evaluation.compare import MOTIONS, orders
from rhot_app.evaluation.data_sets import DataSet, data_set, data_sets_folder
from rhot_app.evaluation.run import SETTLE_S
from rhot_app.progress import ProgressLine
from rhot_app.simulator.film.node_log import T0_MASTER_NS
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.sources.replay import LogValidator
from rhot_app.tracking.markers.marker_model import MarkerModel, compile_markers, project_marker
from rhot_app.tracking.tracker import CameraObservations

Array = NDArray[np.float64]

LATER_S = 0.1


@dataclass(frozen=True, slots=True)
class Errors:
    """What one camera saw in F frames: `times_s` (F,), `off` (F, M, 2) px seen less true, NaN where flagged or lost,
    `stated` (F, M) px^2."""

    times_s: Array
    off: Array
    stated: Array


def errors_of(one: DataSet, markers: MarkerModel) -> list[Errors]:
    """Every camera's errors after the first second."""
    door, frames = LogValidator(one.rig), [[] for _ in one.rig.nodes]
    for record in one.records():
        seen = door.feed(record)
        if seen is not None:
            times_s = 1e-9 * (seen.t_row0_master_ns - T0_MASTER_NS
                              + np.nan_to_num(seen.pixels[:, 1]) * seen.row_time_ns)
            if times_s.min() > SETTLE_S and times_s.max() < one.seconds:
                frames[seen.camera].append((times_s.mean(), _off(one, markers, seen, times_s),
                                            0.5 * np.trace(seen.covariances, axis1=1, axis2=2)))
    return [Errors(*(np.array(column) for column in zip(*of_camera, strict=True))) for of_camera in frames]


def _off(one: DataSet, markers: MarkerModel, seen: CameraObservations, times_s: Array) -> Array:
    """(M, 2) px: one frame's observations less where the true hand's silhouettes were at their rows' times."""
    places, palms = one.truth.markers_at(times_s), one.truth.palm_at(times_s)
    out, pixel, slope = np.full(seen.pixels.shape, np.nan), np.empty(2), np.empty((2, 3))
    for m in np.flatnonzero((seen.flags == 0) & np.isfinite(seen.pixels).all(axis=1)):
        if project_marker(places[m, m], np.ascontiguousarray(palms[m]), markers.half_axes[m],
                          markers.poses[seen.camera], markers.intrinsics[seen.camera], pixel, slope):
            out[m] = seen.pixels[m] - pixel
    return out


def summary(takes: Iterable[list[Errors]], roles: tuple[str, ...]) -> list[list[Any]]:
    """A row for each marker, of all takes of a motion."""
    common, own, lasting, stated = [], [], [], []
    for one, other in takes:
        nearest = np.abs(other.times_s[None] - one.times_s[:, None]).argmin(axis=1)
        common.append(0.5 * (one.off + other.off[nearest]))
        own.append((one.off - other.off[nearest]) / np.sqrt(2.0))
        frames = max(1, round(LATER_S / np.diff(one.times_s).mean()))
        lasting.append(own[-1][frames:] * own[-1][:-frames])
        stated.append(one.stated)
    rows = []
    for m, role in enumerate(roles):
        both, alone, later = (np.concatenate([part[:, m] for part in parts]) for parts in (common, own, lasting))
        variance, said = np.nanmean(alone**2), np.nanmean(np.concatenate([part[:, m] for part in stated]))
        rows.append([role, *(float(figure) for figure in (
            np.sqrt(said), np.sqrt(np.nanmean(both**2)), np.sqrt(variance), variance / said,
            np.nanmean(later) / variance))])
    return rows


def main() -> int:
    """Print a row for each motion and marker."""
    parser = arguments(__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=8.0, help="length of a take (default 8)")
    parser.add_argument("--motions", default=",".join(MOTIONS))
    parser.add_argument("--sketched", action="store_true", help="logs without pictures")
    args = parser.parse_args()
    if args.seeds < 1:
        parser.error("--seeds must be 1 or more")
    if not 2.0 <= args.seconds < float("inf") or not all(args.motions.split(",")):
        parser.error("--seconds must be 2 or more, and --motions names with commas between them")
    rows = []
    try:
        for motion in args.motions.split(","):
            takes = [data_set(order, data_sets_folder(), lambda title: ProgressLine(f"filming {title}"), anew=True)
                     for order in orders(make_scene(twin_defaults(), 1), [motion], range(1, args.seeds + 1),
                                         args.seconds, sketched=args.sketched)]
            markers = compile_markers(takes[0].rig)
            rows += [[motion, *row] for row in summary([errors_of(one, markers) for one in takes], markers.roles)]
    except RhotError as exc:
        print(exc, file=sys.stderr)
        return 2
    publish(args, rows, table(["motion", "marker; px", "stated", "common", "own", "share", "lasts"], rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
