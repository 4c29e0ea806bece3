"""A recorded bare hand, tracked from its two videos and the rig alone, against its triangulated landmarks.

    python benchmarks/recorded_hand.py [--json FILE]

What `rhot track` makes of ../shared/data/bare_hand_stereo, judged on the frames from 67 to 119. Truth is what the
landmarks of another program in both videos triangulate to: so this is agreement, not accuracy. `lag`: frames by which
the joints follow. `jitter`: rms of their third differences, as a part of the triangulated points'. One camera alone:
after laying hand on hand. `goes on alone`: the other camera's film ends at frame 67. `held still`: each frame for a
second, with the shipped bones. Needs the hand networks.
"""

from __future__ import annotations

import csv
import sys
import tempfile
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "tests" / "recording")]

from recorded_landmarks import FOLDER, FPS, JUDGED, WHOLE, recording  # noqa: E402
from tables import arguments, publish, table  # noqa: E402

from rhot_app.__main__ import main as rhot  # noqa: E402
from rhot_app.hand.skeleton import JOINTS  # noqa: E402
from rhot_app.project import save_rig  # noqa: E402
from rhot_node.pictures import open_video  # noqa: E402

Array = NDArray[np.float64]

VIDEOS = tuple(str(FOLDER / f"cam{c}_first120.mp4") for c in range(2))


def tracked(words: list[str], folder: Path) -> tuple[list[str], Array]:
    """Conditions and joints (T, 21, 3) mm, NaN without a hand, of the frames from WHOLE on."""
    out = folder / "hand.csv"
    code = rhot(["track", *words, "--out", str(out), "--force", "--json"])
    if code:
        raise SystemExit(code)
    conditions = ["none"] * len(recording().places)
    joints = np.full(recording().places.shape, np.nan)
    with out.open() as file:
        for row in csv.DictReader(file):
            k = round(float(row["time_s"]) * FPS) - WHOLE
            if 0 <= k < len(joints) and row["joint_wrist_x_mm"]:
                conditions[k] = row["condition"]
                joints[k] = [[float(row[f"joint_{joint}_{axis}_mm"]) for axis in "xyz"] for joint in JOINTS]
    return conditions, joints


def agreement(conditions: list[str], joints: Array) -> dict[str, float]:
    """Of two cameras, with the places where they are."""
    places = 1e3 * recording().places
    off = joints - places
    distance = np.linalg.norm(off, axis=2)[JUDGED]
    moved = 0.5 * (places[2:] - places[:-2])
    own, other = (np.sqrt(np.nanmean(np.diff(one[JUDGED], 3, axis=0) ** 2)) for one in (joints, places))
    return {"tracking": float(np.mean(np.array(conditions) == "TRACKING")), "median mm": float(np.nanmedian(distance)),
            "95 % mm": float(np.nanpercentile(distance, 95)),
            "worst frame mm": float(np.nanmedian(distance, axis=1).max()),
            "lag": float(-np.nansum(off[1:-1] * moved) / np.nansum(moved**2 * np.isfinite(off[1:-1]))),
            "jitter": float(own / other)}


def aligned(joints: Array) -> float:
    """Median mm over the joints after the best turn and shift."""
    found = []
    for one, other in zip(joints[JUDGED], 1e3 * recording().places[JUDGED], strict=True):
        if np.isfinite(one).all():
            one, other = one - one.mean(axis=0), other - other.mean(axis=0)
            left, _, right = np.linalg.svd(one.T @ other)
            turn = left @ np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))]) @ right
            found.append(np.linalg.norm(one @ turn - other, axis=1))
    return float(np.median(found))


def first_frames(film: str, count: int, out: Path) -> str:
    """The film's first frames as another film."""
    capture = open_video(Path(film))
    size = int(capture.get(cv2.CAP_PROP_FRAME_WIDTH)), int(capture.get(cv2.CAP_PROP_FRAME_HEIGHT))
    writer = cv2.VideoWriter(str(out), cv2.VideoWriter.fourcc(*"MJPG"), FPS, size)
    for _ in range(count):
        writer.write(capture.read()[1])
    writer.release()
    return str(out)


def main() -> int:
    """Print the tables."""
    args = arguments(__doc__).parse_args()
    rows: list[list[Any]] = []
    with tempfile.TemporaryDirectory() as folder:
        rig = Path(folder) / "rig.json"
        save_rig(rig, recording().rig)
        for name, more in (("bones measured", []), ("bones measured, smoothed", ["--smooth"]),
                           ("shipped bones", ["--bones", "rig"])):
            found = agreement(*tracked([*VIDEOS, "--rig", str(rig), *more], Path(folder)))
            rows.append([name, *found.values()])
        alone: list[list[Any]] = []
        for c in range(2):
            alone.append([f"camera {c} alone", aligned(tracked([f"c{c}={VIDEOS[c]}", "--rig", str(rig)],
                                                               Path(folder))[1])])
            cut = [*VIDEOS]
            cut[1 - c] = first_frames(VIDEOS[1 - c], WHOLE + JUDGED.start, Path(folder) / "cut.avi")
            joints = tracked([*cut, "--rig", str(rig)], Path(folder))[1]
            off = np.linalg.norm(joints - 1e3 * recording().places, axis=2)[JUDGED]
            alone.append([f"camera {c} goes on alone", float(np.nanmedian(off))])
    still = np.array([recording().held_still(k) for k in range(JUDGED.start, JUDGED.stop, 2)])
    alone.append(["held still, the worst frame's median", float(np.median(still, axis=1).max())])
    alone.append(["held still, the worst joint", float(still.max())])
    publish(args, {"two cameras": rows, "others": alone}, table(["two cameras", *found], rows),
            table(["", "mm"], alone))
    return 0


if __name__ == "__main__":
    sys.exit(main())
