"""What a recorded bare hand's states say where the rig is wrong: another scale, films that began apart, swapped ones.

    python benchmarks/wrong_rigs.py [--json FILE]

The two-camera film of ``../shared/data/bare_hand_stereo`` through the hand networks, tracked as ``rhot track`` does.
`agree, mm`: median over the landmarks of both cameras of the distance between landmark and joint at the hand; the
median and the greatest of the states that are called TRACKING. `DISAGREEMENT_M` (`rhot_app.hand.landmarks`) lies above
the first two rows. In a wrong scale from 0.9 to 1.3 the hand is as a smaller or larger hand would be, and no picture
tells it.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from tables import arguments, publish, table

from rhot_app.errors import RhotError
from rhot_app.export.landmark_track import find_hands, landmark_rig_of, states_of_log, with_measured_bones
from rhot_app.geometry.camera import CameraModel
from rhot_app.project import Rig
from rhot_app.recording.landmark_log import HandFilm, landmark_order, write_hand_log
from rhot_app.sources.frame_sets import open_videos
from rhot_app.state import Condition, HandState
from rhot_node.errors import NodeError

sys.path.append(str(Path(__file__).parents[1] / "tests" / "recording"))
from recorded_landmarks import FOLDER, recording

TOGETHER_NS = 15_000_000  # half a frame of 30 images/s
SCALES = 0.58, 0.75, 0.9, 1.1, 1.3, 1.7
OFFSETS_S = 1.0 / 30.0, 0.1, 0.25, 0.5


def scaled(rig: Rig, scale: float) -> Rig:
    """The rig with its cameras `scale` times as far apart."""
    return msgspec.structs.replace(rig, nodes=tuple(msgspec.structs.replace(node, pose=msgspec.structs.replace(
        node.pose, translation_m=tuple(scale * part for part in node.pose.translation_m))) for node in rig.nodes))


def agreement_mm(rig: Rig, state: HandState) -> float:
    """Median distance of a state's landmarks from its joints, mm at the hand."""
    order, errors = np.array(landmark_order(rig)), []
    for node, pixels in zip(rig.nodes, state.camera_pixels, strict=True):
        camera = CameraModel.from_rig(node.intrinsics, node.pose)
        joints = state.joint_positions[order]
        errors.append(np.linalg.norm(camera.project(joints) - pixels, axis=1) / camera.pixels_per_metre(joints))
    return 1e3 * float(np.nanmedian(np.concatenate(errors)))


def study(rig: Rig, films: list[HandFilm], *, measure: bool = True) -> dict[str, Any]:
    """Of one rig and one pair of films."""
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "hand.rhotlog"
        write_hand_log(log, rig, films)
        if measure:
            rig, _ = with_measured_bones(rig, log)
        states = list(states_of_log(rig, log))
    states = [state for state, after in zip(states, [*states[1:], None], strict=True)  # the last of each instant
              if after is None or after.t_master_ns - state.t_master_ns > TOGETHER_NS]
    tracking = [agreement_mm(rig, state) for state in states if state.condition is Condition.TRACKING]
    return {"states": len(states), "tracking": len(tracking),
            "agree": [float(part) for part in np.percentile(tracking, (50, 100))] if tracking else [np.nan, np.nan]}


def main() -> int:
    """Print a row for each rig."""
    parser = arguments(__doc__)
    args = parser.parse_args()
    try:
        rig = recording().rig
        rig = landmark_rig_of(rig, [node.name for node in rig.nodes])
        paths = {node.name: str(FOLDER / f"cam{k}_first120.mp4") for k, node in enumerate(rig.nodes)}
        films = [find_hands(video) for video in open_videos(rig, paths, None)]
    except (RhotError, NodeError) as exc:
        print(exc, file=sys.stderr)
        return 2
    late = {f"right film {offset:.2f} s late": (rig, [films[0], replace(films[1], times_s=films[1].times_s + offset)])
            for offset in OFFSETS_S}
    found = {"the rig": study(rig, films), "the shipped hand's bones": study(rig, films, measure=False)}
    found |= {f"scale {scale:g}": study(scaled(rig, scale), films) for scale in SCALES}
    found |= {name: study(*case) for name, case in late.items()} | {"swapped": study(rig, films[::-1])}
    publish(args, found, table(["", "states", "TRACKING", "agree, mm", "at most"],
                               [[name, one["states"], one["tracking"], *one["agree"]] for name, one in found.items()]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
