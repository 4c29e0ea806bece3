"""How far the surface's contour lies from the edges of a real hand, by region.

    python benchmarks/contour_offsets.py [--data ../shared/data/bare_hand_stereo] [--unit-mm 38.5] [--json FILE]

The pose and the bones are fitted to the recording's landmarks, so they know nothing of edges. From every point of the
expected outline, the nearest edge between hand and background within 12 mm or 28 px, whichever is less, is taken.
Positive: the hand is larger than the surface. The last columns are of the same surface without the little finger's
ball, `surface.HYPOTHENAR`, whose measure they are. The recording's unit of length is unknown; `--unit-mm` makes its
hand as large as the hand file's.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import msgspec
import numpy as np
from landmarks import DATA, FPS, landmark_errors, recorded_rig, triangulated
from numpy.typing import NDArray
from tables import arguments, publish, table

from rhot_app.barehand.contours import SILHOUETTE
from rhot_app.barehand.surface import FOREARM, PALM, Surface
from rhot_app.barehand.tracker import BareHandTracker
from rhot_app.export.landmark_track import states_of_log
from rhot_app.geometry.camera import CameraModel
from rhot_app.hand.skeleton import FINGERS, HandPose
from rhot_app.project import Rig
from rhot_app.recording.landmark_log import read_landmark_table, write_landmark_log
from rhot_node.detect.edges import find_edges, noise_of
from rhot_node.detect.foreground import learn_skin
from rhot_node.pictures import open_video

Array = NDArray[np.float64]

REACH_M, REACH_PX = 0.012, 28.0
EVERY = 2  # frames; neighbouring ones are alike
POSE_SD = 1e-3, 1e-2, 1e-2  # m, rad, rad: the pose is taken as it is
PALM_REGIONS = ("forefinger's side", "middle", "middle", "little finger's side", "knuckles", "knuckles", "knuckles",
                "little finger's side", "thumb's ball", "thumb's ball")
"""Of the palm's capsules, in the order of `surface_of`."""


def without_ball(surface: Surface) -> Surface:
    """The surface without the capsule of the little finger's ball."""
    ball = int(np.flatnonzero(surface.group == PALM)[7])
    return surface._replace(**{name: np.delete(getattr(surface, name), ball, axis=0)
                               for name in ("row", "ends", "radii", "group", "open_ends")})


def regions_of(surface: Surface, with_ball: bool) -> list[str]:
    """Each capsule's region."""
    palm = [one for k, one in enumerate(PALM_REGIONS) if with_ball or k != 7]
    return [*(f"{FINGERS[group]}" for group in surface.group[surface.group < PALM]), *palm,
            *("forearm" for _ in range(int(np.sum(surface.group == FOREARM))))]


def pictures(path: Path) -> list[NDArray[np.uint8]]:
    """(H, W, 3) RGB, all of a film."""
    film, found = open_video(path), []
    while (read := film.read())[0]:
        found.append(np.ascontiguousarray(read[1][..., ::-1]))
    return found


def fitted(folder: Path, unit_m: float) -> tuple[Rig, dict[int, HandPose]]:
    """The recording's cameras with the hand that fits its landmarks, and the tracked pose by frame."""
    rig = recorded_rig(folder, unit_m)
    tables = [read_landmark_table(folder / f"landmarks_c{k}.csv", FPS) for k in range(2)]
    frames = [np.round(one.times_s * FPS).astype(int) for one in tables]
    both = np.intersect1d(*frames)
    pixels = np.array([one.pixels[np.searchsorted(own, both)] for one, own in zip(tables, frames, strict=True)])
    cameras = [CameraModel.from_rig(node.intrinsics, node.pose) for node in rig.nodes]
    _, hand = landmark_errors(rig, cameras, both / FPS, pixels, triangulated(cameras, pixels))
    rig = msgspec.structs.replace(rig, hand=hand)
    with tempfile.TemporaryDirectory() as name:
        log = Path(name) / "hand.log"
        write_landmark_log(log, rig, tables)
        states = list(states_of_log(rig, log))
    begin_s = min(one.times_s[0] for one in tables)
    poses = {round((1e-9 * (state.t_master_ns - states[0].t_master_ns) + begin_s) * FPS):
             HandPose(state.world_from_palm, state.angles) for state in states if state.tracked}
    return rig, {frame: poses[frame] for frame in both if frame in poses}


def offsets(tracker: BareHandTracker, surface: Surface, pose: HandPose, images: list[NDArray[np.uint8]]) -> tuple[
        list[int], list[float]]:
    """The capsules of the outline's points in all images, and how far their edges lie outwards, m; NaN for none."""
    tracker.surface = surface
    tracker.start(pose, 0, POSE_SD)
    capsules, found = [], []
    for camera, image in enumerate(images):
        frame = tracker.expected_contour(camera, tracker.filter.newest.state, tracker.filter.newest.covariance)
        scale = frame.points.scale
        frame.slices[:, 4] = np.minimum(REACH_M * scale, REACH_PX)
        edges = find_edges(image, frame.slices, learn_skin(image), noise_of(image))
        ours = (np.arange(edges.offset.shape[1]) < edges.number[:, None]) & (edges.inside > 0.5) & (edges.outside < 0.5)
        away = np.where(ours, edges.offset, np.inf)
        nearest = away[np.arange(len(away)), np.argmin(np.abs(away), axis=1)]
        outline = frame.points.behind == SILHOUETTE
        capsules += frame.points.capsule[outline].tolist()
        found += np.where(np.isfinite(nearest), nearest / scale, np.nan)[outline].tolist()
    return capsules, found


def main() -> int:
    """Measure and print; a sentence where the recording is not there."""
    parser = arguments(__doc__)
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument("--unit-mm", type=float, default=38.5)
    args = parser.parse_args()
    if not args.data.is_dir():
        print(f"{args.data} is not there: no contour of a real hand was measured. Give its folder by --data.",
              file=sys.stderr)
        return 0
    rig, poses = fitted(args.data, 1e-3 * args.unit_mm)
    films = [pictures(args.data / f"cam{k}_first120.mp4") for k in range(2)]
    tracker = BareHandTracker(rig)
    whole, columns = tracker.surface, {}
    for name, surface in (("with", whole), ("without", without_ball(whole))):
        regions, gathered = np.array(regions_of(surface, name == "with")), {}
        for frame in list(poses)[::EVERY]:
            capsules, away = offsets(tracker, surface, poses[frame], [film[frame] for film in films])
            for region, one in zip(regions[capsules], away, strict=True):
                gathered.setdefault(str(region), []).append(1e3 * one)
        columns[name] = gathered
    figures = {name: {region: {"points": len(values), "found": float(np.mean(np.isfinite(values))),
                               "mean_mm": float(np.nanmean(values)), "sd_mm": float(np.nanstd(values)),
                               "rms_mm": float(np.sqrt(np.nanmean(np.square(values))))}
                      for region, values in (gathered | {"all": [v for one in gathered.values() for v in one]}).items()}
               for name, gathered in columns.items()}
    rows = [[region, one["points"], f"{100.0 * one['found']:.0f} %", one["mean_mm"], one["sd_mm"],
             figures["without"][region]["points"], figures["without"][region]["mean_mm"],
             figures["without"][region]["sd_mm"]] for region, one in figures["with"].items()]
    publish(args, figures, table(["region", "points of the outline", "with an edge", "edge outside by, mm", "sd",
                                  "without the ball: points", "edge outside by, mm", "sd"], rows),
            f"{len(list(poses)[::EVERY])} moments of two cameras. Of each point, edges are looked for within "
            f"{1e3 * REACH_M:.0f} mm or {REACH_PX:.0f} px, whichever is less: an offset beyond is none, and counts as "
            "without an edge.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
