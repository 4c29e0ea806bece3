"""A real coloured cube, moved, scaled, dimmed and covered in its pictures: what the detector says of its faces.

    python benchmarks/moved_cube.py [--seeds 6] [--json FILE]

The three pictures of ../shared/data/trifinger_cube, 60 frames a seed, with noise of 3 grey levels. `pan` moves a
picture, `zoom` scales it by 0.65 to 1.35, `dim` halves its light, `cover` moves a skin-coloured bar of 12 to 42 px over
it by 5 px a frame, `lean` one that leans by 45 degrees. Truth is the first picture's place, moved alike: so this is
consistency, not accuracy. Error and normalised squared error e' C^-1 e are of observations without a flag; `far`: more
than 8 px off. `doubtful`: flagged though nothing hides the face, but of a cover. `false`: observations of a still cube
(40 frames) that are no visible face. Where the pictures are missing, it says so and prints nothing.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from tables import arguments, publish, table

from rhot_node.detect.fast import DOUBTFUL, FastDetector
from rhot_node.detect.image import from_bgr
from rhot_node.files import resource_path
from rhot_node.markers import load_markers
from rhot_node.pictures import decode_picture

FOLDER = Path(__file__).resolve().parents[2] / "shared" / "data" / "trifinger_cube"
CUBE = load_markers(resource_path("markers", "trifinger_cube.json"))
CAMERAS = (60, 180, 300)
KINDS = ("pan", "zoom", "dim", "cover", "lean")
FRAMES, STILL_FRAMES = 60, 40
NOISE, FAR_PX = 3.0, 8.0
BAR_BGR, BAR_PX_PER_FRAME, BAR_START_PX = (90.0, 120.0, 160.0), 5, 150

Image = NDArray[np.float64]
Array = NDArray[np.float64]


def picture(camera: int) -> tuple[Image, set[int]]:
    """A camera's picture, and the indices of the faces that it shows."""
    bgr = decode_picture((FOLDER / f"camera{camera}.png").read_bytes())
    faces = {index for index, name in enumerate(CUBE.ids) if (FOLDER / f"{name[0]}{camera}.png").exists()}
    return bgr.astype(np.float64), faces


def moved(bgr: Image, kind: str, seed: int) -> Iterator[tuple[Image, Array]]:
    """Pictures without noise, and (2, 3) where the first one's pixels are in each."""
    height, width = bgr.shape[:2]
    across, down = np.meshgrid(np.arange(width), np.arange(height))
    for k in range(FRAMES):
        scale, gain, shift = 1.0, 1.0, np.zeros(2)
        if kind == "pan":
            shift = np.array([(40 + 8 * seed) * np.sin(k / (6 + seed)), 30 * (np.sin(k / 5 + seed) - np.sin(seed))])
        elif kind == "zoom":
            scale = 1.0 + 0.35 * np.sin(k / (8 + seed))
        elif kind == "dim":
            gain = 0.75 + 0.25 * np.cos(k / (5 + seed))
        matrix = np.column_stack([scale * np.eye(2), (1.0 - scale) * 0.5 * np.array([width, height]) + shift])
        image = gain * cv2.warpAffine(bgr, matrix, (width, height), flags=cv2.INTER_AREA,
                                      borderMode=cv2.BORDER_REFLECT)
        along = {"cover": across, "lean": across + down - height // 2}.get(kind)
        if along is not None:
            start = BAR_START_PX + BAR_PX_PER_FRAME * k
            image[(along >= start) & (along < start + 12 + 6 * seed)] = BAR_BGR
        yield np.asarray(image, np.float64), matrix


def noisy(image: Image, rng: np.random.Generator) -> NDArray[np.uint8]:
    return np.clip(image + rng.normal(0.0, NOISE, image.shape), 0, 255).round().astype(np.uint8)


def figures(camera: int, kind: str, seeds: int) -> dict[str, float]:
    """Counts, 95th percentile of the errors, px, and of the normalised squared errors."""
    bgr, faces = picture(camera)
    errors: list[float] = []
    normalised: list[float] = []
    doubtful = lost = 0
    for seed in range(seeds):
        rng, detector, first = np.random.default_rng(seed), FastDetector(CUBE), dict[int, Array]()
        for image, matrix in moved(bgr, kind, seed):
            seen = detector.detect(from_bgr(noisy(image, rng)))[:len(CUBE.ids)]
            first = first or {mark.index: np.array([mark.x, mark.y, 1.0]) for mark in seen
                              if mark.found and mark.index in faces}
            for index, place in first.items():
                mark = seen[index]
                if not mark.found or mark.flags & DOUBTFUL:
                    lost, doubtful = lost + (not mark.found), doubtful + mark.found
                    continue
                error = np.array([mark.x, mark.y]) - matrix @ place
                stated = np.array([[mark.cov_xx, mark.cov_xy], [mark.cov_xy, mark.cov_yy]])
                errors.append(float(np.hypot(*error)))
                normalised.append(float(error @ np.linalg.solve(stated, error)))
    return {"plain": len(errors), "doubtful": doubtful, "lost": lost, "far": int(np.sum(np.array(errors) > FAR_PX)),
            "error_px_p95": float(np.percentile(errors, 95)), "nse_p95": float(np.percentile(normalised, 95))}


def false_of_still(camera: int) -> int:
    """Observations that are no visible face."""
    bgr, faces = picture(camera)
    rng, detector = np.random.default_rng(0), FastDetector(CUBE)
    return sum(mark.found and mark.index not in faces for _ in range(STILL_FRAMES)
               for mark in detector.detect(from_bgr(noisy(bgr, rng)))[:len(CUBE.ids)])


def main() -> int:
    """Print a row for each kind and camera."""
    parser = arguments(__doc__)
    parser.add_argument("--seeds", type=int, default=6)
    args = parser.parse_args()
    if not FOLDER.is_dir():
        print(f"real pictures are not there ({FOLDER}): nothing is measured", file=sys.stderr)
        return 0
    report: dict[str, Any] = {kind: {str(camera): figures(camera, kind, args.seeds) for camera in CAMERAS}
                              for kind in KINDS}
    false = {str(camera): false_of_still(camera) for camera in CAMERAS}
    publish(args, report | {"false": false},
            table(["moved, camera", "plain", "doubtful", "lost", "far", "error, px, p95", "normalised squared, p95"],
                  [[f"{kind}, {camera}", *row.values()] for kind, rows in report.items()
                   for camera, row in rows.items()]),
            table(["camera", "false, still"], false.items()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
