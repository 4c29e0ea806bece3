"""How precisely and how truly markers are placed, against the truth, the Cramer-Rao bound and the thesis's box centre.

    python benchmarks/centroid.py [--only disc|twin] [--poses N] [--json FILE]

Discs of 20 px in the paints of `rhot6`, shaded by 25 %, noise of 4 grey levels in red, green and blue, lens blur of 0.7
px: on grey, on the edge between skin and desk, and moving, exposed for 16 % of the frame. Jitter: standard deviation
about the mean, per axis; the bound is that of a single frame, with radius, colours and shading unknown.

Then the twin's painted fingertips and wrist band, at 0.6 m with its own noise: bias and jitter against the true outline
(band: the projected axis), and the mean bias of left minus right against the outlines, which is depth.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "detect"))

from chroma_bound import place_bound  # noqa: E402
from marker_rendering import SKIN, Canvas, disc, to_yuv  # noqa: E402
from tables import arguments, publish, table  # noqa: E402
from twin_frames import Pose, held_poses, twin_scene  # noqa: E402

from rhot_node.detect.fast import FastDetector  # noqa: E402
from rhot_node.detect.image import Detector, YuvImage  # noqa: E402
from rhot_node.detect.reference import ReferenceDetector  # noqa: E402
from rhot_node.files import resource_path  # noqa: E402
from rhot_node.markers import Marker, MarkerSet, load_markers  # noqa: E402

MARKERS = load_markers(resource_path("markers", "rhot6.json"))
GREY, DESK = (120.0, 122.0, 118.0), (142.0, 104.0, 70.0)
RADIUS, SHADING, TOWARDS, NOISE = 10.0, 0.25, 0.6, 4.0
PLACES, FRAMES, SETTLE = 12, 40, 12
EXPOSED, MOMENTS, FASTEST = 0.16, 5, 9.0  # of a frame; per exposure; px per frame
SIZE = (112, 96)
DISC_AIMS = ("aim", None, "0.016", 1.15, 0.01, None, None, 0.1, 0.035, None)  # as the columns of the table
TWIN_AIMS = ("aim", 0.03, 0.03, 0.2, 0.05, None, None)

Array = np.ndarray


def drawn(parameters: Array) -> Canvas:
    """A disc: x, y, radius, paint's rgb, shading, its direction, the surroundings' rgb."""
    x, y, radius, *paint, shading, towards = parameters[:8].tolist()
    canvas = Canvas(*SIZE, tuple(parameters[8:].tolist()))
    return canvas.paint(disc(x, y, radius), tuple(paint), (50.0, 44.0), RADIUS + 3.0, shading, towards)


def on_grey(marker: Marker, x: float, y: float) -> Array:
    """The parameters of a disc of the marker's paint on grey."""
    return np.array([x, y, RADIUS, *marker.display_rgb, SHADING, TOWARDS, *GREY], dtype=np.float64)


def on_an_edge(marker: Marker, x: float, y: float) -> Canvas:
    """Half on skin, half on a desk."""
    canvas = Canvas(*SIZE, DESK).paint(lambda px, py: px + 0.0 * py < 50.0, SKIN, (0.0, 48.0), 120.0)
    return canvas.paint(disc(x, y, RADIUS), marker.display_rgb, (50.0, 44.0), RADIUS + 3.0, SHADING, TOWARDS)


def seen_by(detector: Detector, images: Sequence[YuvImage], truth: Array) -> Array:
    """(F, M, 2) px: of every marker the candidate nearest to `truth` (M, 2) or (F, M, 2), for the master chooses one of
    them; NaN where there is none."""
    truth = np.broadcast_to(truth, (len(images), *np.shape(truth)[-2:]))
    out = np.full(truth.shape, np.nan)
    for number, image in enumerate(images):
        for mark in detector.detect(image):
            place, true = np.array([mark.x, mark.y]), truth[number, mark.index]
            if not np.linalg.norm(out[number, mark.index] - true) <= np.linalg.norm(place - true):
                out[number, mark.index] = place
    return out


def still_disc(marker: Marker, edge: bool) -> dict[str, dict[str, float]]:
    """Jitter per axis, and rms of the bias, of both detectors, over sub-pixel places."""
    rng = np.random.default_rng(7)
    found: dict[str, list[Array]] = {"fast": [], "box": []}
    for x, y in np.array([50.0, 44.0]) + rng.uniform(-1.0, 1.0, (PLACES, 2)):
        canvas = on_an_edge(marker, x, y) if edge else drawn(on_grey(marker, x, y))
        images = [canvas.expose(rng, NOISE) for _ in range(FRAMES)]
        for name, detector in detectors(marker).items():
            found[name].append(seen_by(detector, images, np.array([[x, y]]))[SETTLE:, 0] - (x, y))
    return {name: {"jitter": float(np.sqrt(np.mean([np.var(part, axis=0, ddof=1) for part in parts]))),
                   "bias": float(np.sqrt(np.mean([part.mean(axis=0) ** 2 for part in parts]))),
                   "worst": float(max(np.hypot(*part.mean(axis=0)) for part in parts))}
            for name, parts in found.items()}


def moving_disc(marker: Marker) -> dict[str, float]:
    """Rms error per axis of a disc that goes to and fro, up to FASTEST px per frame."""
    rng = np.random.default_rng(8)
    images, truth = [], []
    for step in range(120):
        swing = [(210.0 + FASTEST / 0.1 * np.sin(0.1 * t), 60.3 + 20.0 * np.sin(0.037 * t))
                 for t in step + EXPOSED * ((np.arange(MOMENTS) + 0.5) / MOMENTS - 0.5)]
        rgb = np.zeros((120, 420, 3))
        for x, y in swing:
            rgb += Canvas(420, 120, GREY).paint(disc(x, y, RADIUS), marker.display_rgb, (x, y), RADIUS + 3.0,
                                                SHADING, TOWARDS).seen() / MOMENTS
        images.append(to_yuv(np.clip(rgb + rng.normal(0.0, NOISE, rgb.shape), 0.0, 255.0)))
        truth.append((210.0 + FASTEST / 0.1 * np.sin(0.1 * step), 60.3 + 20.0 * np.sin(0.037 * step)))
    return {name: float(np.sqrt(np.nanmean((seen_by(detector, images, np.array(truth)[:, None])[SETTLE:, 0]
                                             - np.array(truth)[SETTLE:]) ** 2)))
            for name, detector in detectors(marker).items()}


def detectors(marker: Marker) -> dict[str, Detector]:
    """Ours and the thesis's, for this marker alone."""
    alone = MarkerSet(markers=(marker,))
    return {"fast": FastDetector(alone), "box": ReferenceDetector(alone)}


def discs() -> dict[str, Any]:
    """Every paint: bound, still, on an edge, moving."""
    results: dict[str, Any] = {}
    for painted in MARKERS.markers:
        marker = msgspec.structs.replace(painted, shape="disc", role=None)
        results[marker.id] = {
            "bound": float(np.sqrt(np.mean(place_bound(drawn, on_grey(marker, 50.2, 44.3), NOISE) ** 2))),
            "grey": still_disc(marker, False), "edge": still_disc(marker, True), "moving": moving_disc(marker)}
    return results


def twin(poses: int) -> dict[str, Any]:
    """The painted hand before cloth and before a cluttered desk."""
    results: dict[str, Any] = {}
    for background, motion, seed in (("cloth", "grasp", 1), ("clutter", "rest", 3)):
        scene = twin_scene(background, seed=seed)
        rows: list[list[Array]] = [[] for _ in MARKERS.markers]
        boxes: list[list[Array]] = [[] for _ in MARKERS.markers]
        for pose in held_poses(scene, motion, poses, FRAMES // 2):
            for name, store in (("fast", rows), ("box", boxes)):
                _score(pose, name, store)
        results[f"{motion} before {background}"] = {}
        for marker, ours, theirs in zip(MARKERS.markers, rows, boxes, strict=True):
            if not ours:
                continue
            a, b = np.array(ours), np.array(theirs)  # (N, 2 cameras, columns of `_score`)
            figures = _figures(a) | {f"box_{key}": value for key, value in _figures(b).items()}
            results[f"{motion} before {background}"][marker.id] = figures
    return results


def _score(pose: Pose, name: str, store: list[list[Array]]) -> None:
    """Of each marker that both cameras see whole, (2 cameras, 5): mean error (x, y), variance (x, y), and the mean
    horizontal error against the outline, whose perspective the master corrects (`geometry.camera.point_rays`)."""
    kind = FastDetector if name == "fast" else ReferenceDetector
    seen = [seen_by(kind(MARKERS), frames, truth)[4:] for frames, truth in zip(pose.frames, pose.centre, strict=True)]
    for index, marker in enumerate(MARKERS.markers):
        truth = pose.centre[:, index] if marker.shape == "band" else pose.outline[:, index]
        points = np.array([part[:, index] for part in seen])
        if np.isfinite(truth).all() and np.isfinite(points).all():
            mean = points.mean(axis=1)
            store[index].append(np.concatenate([mean - truth, points.var(axis=1, ddof=1),
                                                mean[:, :1] - pose.outline[:, index, :1]], axis=1))


def _figures(scored: Array) -> dict[str, float]:
    jitter = np.sqrt(scored[:, :, 2:4].mean(axis=(0, 1)))
    return {"jitter_x": float(jitter[0]), "jitter_y": float(jitter[1]),
            "bias": float(np.sqrt((scored[:, :, :2] ** 2).sum(axis=2).mean())),
            "left_minus_right": float((scored[:, 0, 4] - scored[:, 1, 4]).mean())}


def main() -> int:
    """Run, print the tables, write the JSON."""
    parser = arguments(__doc__)
    parser.add_argument("--only", choices=("disc", "twin"))
    parser.add_argument("--poses", type=int, default=12)
    args = parser.parse_args()
    result: dict[str, Any] = {}
    printed = []
    if args.only != "twin":
        result["disc"] = discs()
        printed.append(table(
            ["disc of 20 px; px", "bound", "jitter", "ratio", "bias rms", "thesis's box: jitter", "bias",
             "bias across a skin/desk edge", "moving, rms", "box, moving"],
            [[name, f"{one['bound']:.4f}", f"{one['grey']['fast']['jitter']:.4f}",
              one["grey"]["fast"]["jitter"] / one["bound"], one["grey"]["fast"]["bias"], one["grey"]["box"]["jitter"],
              one["grey"]["box"]["bias"], one["edge"]["fast"]["bias"], one["moving"]["fast"], one["moving"]["box"]]
             for name, one in result["disc"].items()] + [DISC_AIMS]))
    if args.only != "disc":
        result["twin"] = twin(args.poses)
        printed.append(table(
            ["the twin's hand; px", "jitter x", "y", "bias", "left - right", "thesis's box: bias", "left - right"],
            [[f"{scene}, {name}", *(figures[key] for key in ("jitter_x", "jitter_y", "bias", "left_minus_right",
                                                             "box_bias", "box_left_minus_right"))]
             for scene, markers in result["twin"].items() for name, figures in markers.items()] + [TWIN_AIMS]))
    publish(args, result, *printed)
    return 0


if __name__ == "__main__":
    sys.exit(main())
