"""Whether a recorded bare hand is taken for one that has a given start pose, by its contours alone.

    python benchmarks/start_pose.py [--every 9] [--json FILE]

Both cameras' pictures of frame j of ../shared/data/bare_hand_stereo stand still, and the start pose is the hand's pose
in frame i, or in j itself, as its landmarks show it. `accepted`: the hand is followed after the dwell time. `wrong`: of
these, the median joint is 20 mm or more from the hand's pose by landmarks. The colours of skin are learnt from the
pictures.
"""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / "tests" / "recording")]

from recorded_landmarks import FITTED, FOLDER, FPS, WHOLE, recorded_states, recording  # noqa: E402
from tables import arguments, publish, table  # noqa: E402

from rhot_app.barehand.start import MIN_DWELL_NS  # noqa: E402
from rhot_app.barehand.tracker import BareHandTracker  # noqa: E402
from rhot_app.calibration.hand.landmark_bones import measure_bones  # noqa: E402
from rhot_app.calibration.hand.marker_places import tracks_of  # noqa: E402
from rhot_app.hand.skeleton import HandPose  # noqa: E402
from rhot_node.detect.foreground import learn_skin  # noqa: E402
from rhot_node.pictures import open_video  # noqa: E402

APART_MM = (0.0, 1e-6, 10.0, 20.0, 40.0, np.inf)
WRONG_MM = 20.0
STEPS = 4


def films() -> list[list[np.ndarray]]:
    """Pictures (H, W, 3) RGB of each camera, from WHOLE on."""
    found = []
    for c in range(2):
        film, own = open_video(FOLDER / f"cam{c}_first120.mp4"), []
        while (read := film.read())[0]:
            own.append(np.ascontiguousarray(read[1][..., ::-1]))
        found.append(own[WHOLE:])
    return found


def main() -> int:
    """Print the tables."""
    parser = arguments(__doc__)
    parser.add_argument("--every", type=int, default=9, help="frames from one picture to the next")
    args = parser.parse_args()
    places = recording().places
    roles = {marker.id: marker.role or "" for marker in recording().rig.markers.markers}
    hand = measure_bones(tracks_of(np.arange(len(places)) / FPS, places, recording().rig.markers.ids, roles),
                         recording().rig.hand).hand
    rig = msgspec.structs.replace(recording().rig, hand=hand)
    states, pictures = recorded_states(hand), films()
    rows: list[tuple[int, float, bool, float]] = []  # j, mm between the poses, accepted, mm of what was found
    for j in range(0, len(places), args.every):
        images = [own[j] for own in pictures]
        skin = [learn_skin(image) for image in images]
        for i in sorted({*range(0, len(places), args.every + 4), j}):
            tracker = BareHandTracker(rig, foreground=skin)
            tracker.start_pose = HandPose(states[i].world_from_palm, states[i].angles)
            apart = float(np.median(np.linalg.norm(states[i].joint_positions - states[j].joint_positions, axis=1)))
            accepted, off = tracker.begin(images, 0), 0.0
            if accepted:
                for t_ns in np.linspace(0, MIN_DWELL_NS, STEPS).astype(int).tolist():
                    state = tracker.step(images, [t_ns] * 2)
                accepted = tracker.verified(tracker.maps_of(images))
                off = float(np.median(np.linalg.norm(state.joint_positions - states[j].joint_positions, axis=1)))
            rows.append((j, 1e3 * apart, accepted, 1e3 * off))
            print(f"\r{len(rows)}", end="", file=sys.stderr)
    figures: list[list[Any]] = []
    for name, first, last in (("13 to 66", 0, FITTED.stop), ("67 to 119", FITTED.stop, len(places))):
        for low, high in pairwise(APART_MM):
            own = [row for row in rows if first <= row[0] < last and low <= row[1] < high]
            if own:
                figures.append([name, f"{low:.0f} to {high:.0f}", len(own), float(np.mean([row[2] for row in own])),
                                sum(row[2] and row[3] >= WRONG_MM for row in own),
                                max((row[3] for row in own if row[2]), default=None)])
    publish(args, figures, table(["frames", "start pose away mm", "pairs", "accepted", "wrong", "worst mm"], figures))
    return 0


if __name__ == "__main__":
    sys.exit(main())
