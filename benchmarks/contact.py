"""Time of a signed distance of five points to a mesh, and of a hand's five pads.

    python benchmarks/contact.py [--faces 2000] [--json FILE]

prints microseconds per call (median of batches), for points near the surface, as fingertips are, and anywhere around.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "objects"))

from kinematics import per_call_us
from shapes_oracle import star
from tables import arguments, publish, table

from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.model import build_model, neutral_pose
from rhot_app.objects.contact import fingertip_pads, pad_distances, pad_points
from rhot_app.objects.shape import Box, Mesh
from rhot_node.files import resource_path

TARGET_US = 1000.0


def main() -> int:
    """Measure, print the table, write JSON when asked; exit code 1 when the mesh misses its target."""
    parser = arguments(__doc__)
    parser.add_argument("--faces", type=int, default=2000)
    args = parser.parse_args()
    rng = np.random.default_rng(0)
    around = int(np.sqrt(args.faces))
    vertices, faces = star(rng, args.faces // (2 * around) + 1, around)
    mesh, box = Mesh(vertices, faces), Box((0.06, 0.06, 0.06))
    near = 1.05 * vertices[rng.integers(0, len(vertices), 5)]
    far = rng.uniform(-0.3, 0.3, (5, 3))
    model, pose = build_model(load_hand(resource_path("hands", "right.json"))), neutral_pose()
    pads = fingertip_pads(model)
    points = pad_points(pads, pose.world_from_palm, pose.angles)
    rows = {f"mesh of {len(faces)} faces, 5 points near it": per_call_us(lambda: mesh.signed_distance(near), 1.0, 20),
            f"mesh of {len(faces)} faces, 5 points around it": per_call_us(lambda: mesh.signed_distance(far), 1.0, 20),
            "box, 5 points": per_call_us(lambda: box.signed_distance(near), 1.0, 20)}
    for name, shape in (("mesh", mesh), ("box", box)):
        rows[f"five pads, 15 spheres, {name}"] = per_call_us(
            lambda shape=shape: pad_distances(pads, points, shape, np.eye(4)), 1.0, 20)
    worst = max(value for what, value in rows.items() if what.startswith("mesh"))
    publish(args, {"us": rows, "target_us": TARGET_US}, table(["", "processor time, µs"], rows.items()))
    return 0 if worst <= TARGET_US else 1


if __name__ == "__main__":
    sys.exit(main())
