"""How well a hand is fitted to two pictures: simulated bare hands of several people, whose surface is not the model's.

``python benchmarks/hand_fit.py [--persons N] [--json FILE]`` prints a table. Each person's hand varies from the shipped
one as adults' do. Wrist, two knuckles and the fingertips are anchors in both cameras, wrong by ANCHOR_PX; then the
contours are fitted, with the pose alone and with lengths, from the shipped hand.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "handfit"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "barehand"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from fit_scenes import another_hand

from rhot_app.barehand.surface import RADIUS
from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model
from rhot_app.hand.skeleton import HandPose
from rhot_app.handfit.session import HandFit
from rhot_app.project import CameraCalibration, Rig, RigNode
from rhot_app.simulator.film.shot import make_renderer, make_shot
from rhot_app.simulator.scene.scene import make_scene, twin_defaults
from rhot_app.simulator.scene.scene_description import BareHandShow

ANCHOR_PX = 2.0
"""px: how exactly a person points at a joint here, where a pixel shows a millimetre."""

ANCHORED = (0, 5, 17, 4, 8, 12, 16, 20)
MOTIONS = ("still", "spread", "grasp", "rest", "point")
AT_S = 0.3


def fitted(person: int) -> list[dict[str, Any]]:
    """Figures of one person, a row after each stage."""
    motion, rng = MOTIONS[person % len(MOTIONS)], np.random.default_rng(person)
    scene = make_scene(twin_defaults(), seed=person + 1)
    shipped = scene.hand
    scene = replace(scene, hand=another_hand(shipped, person, only=slice(0, RADIUS)))
    shot = make_shot(scene, BareHandShow(motion), seconds=1.0)
    source, lens = shot.scene_object.source, scene.intrinsics
    images = {}
    for camera in range(2):
        frame, _ = make_renderer(shot, camera).render(source, t_row0_s=AT_S, number=0)
        images[camera] = np.asarray(cv2.cvtColor(frame.reshape(lens.height * 3 // 2, lens.width).copy(),
                                                 cv2.COLOR_YUV2RGB_I420), np.uint8)
    worlds, angles = source.sample(np.array([AT_S]))
    joints = forward(build_model(scene.hand), HandPose(worlds[0], angles[0])).joints
    nodes = tuple(RigNode(k + 1, name, lens, scene.poses[k]) for k, name in enumerate(scene.names))
    fit = HandFit(Rig("simulated", nodes, scene.markers, shipped, calibration=CameraCalibration("exact")))
    fit.add_pictures(images)
    fit.anchor_sd_px = ANCHOR_PX
    for camera, model in enumerate(fit.cameras):
        for joint, place in zip(ANCHORED, model.project(joints[list(ANCHORED)]), strict=True):
            x, y = place + ANCHOR_PX * rng.standard_normal(2)
            fit.anchor(camera, joint, (float(x), float(y)))
    truth = [bone for finger in scene.hand.fingers.values() for bone in finger.bones_mm]
    rows = []
    for stage in ("anchors", "contours, pose", "contours, lengths"):
        fit.freedom = "lengths" if stage != "contours, pose" else "pose"
        if stage == "anchors":
            fit.fit_to_anchors()
        else:
            fit.take(fit.fitted_to_contours(), stage)
        numbers = [number for number in fit.numbers if number.kind == "length"]
        off = np.array([fit.value(number) - bone for number, bone in zip(numbers, truth, strict=True)])
        scaled = off / np.array([fit.sd(number) for number in numbers])
        places, _ = fit.solver.places(fit.state.shape, fit.instant)
        rows.append({"person": person, "motion": motion, "stage": stage,
                     "joint_mm": float(1e3 * np.mean(np.linalg.norm(places - joints, axis=1))),
                     "bone_rms_mm": float(np.sqrt(np.mean(off**2))), "bone_worst_mm": float(np.max(np.abs(off))),
                     "nees": float(np.mean(scaled**2))})
    return rows


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--persons", type=int, default=10)
    parser.add_argument("--json", type=Path, metavar="FILE")
    args = parser.parse_args()
    rows = []
    for person in range(args.persons):
        print(f"person {person}", file=sys.stderr, flush=True)
        rows += fitted(person)
    print(f"Means of {args.persons} people; mm; the squared errors are normalised by the stated variances")
    print(f"{'after':>20}{'joints':>8}{'bones, rms':>12}{'worst bone':>12}{'squared errors':>16}")
    for stage in dict.fromkeys(row["stage"] for row in rows):
        own = [row for row in rows if row["stage"] == stage]
        means = {key: float(np.mean([row[key] for row in own])) for key in ("joint_mm", "bone_rms_mm", "nees")}
        print(f"{stage:>20}{means['joint_mm']:8.1f}{means['bone_rms_mm']:12.2f}"
              f"{max(row['bone_worst_mm'] for row in own):12.1f}{means['nees']:16.2f}")
    if args.json is not None:
        args.json.write_text(json.dumps(rows, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
