"""What one redrawing of the scene costs: posing the meshes, and drawing them to the end.

    python benchmarks/scene.py [--redraws N] [--json FILE]

Opens one window (on a virtual screen: ``xvfb-run -a``). The hand's joints are a third each measured, inferred and
guessed, with names and uncertainty shown: what costs most. Medians, ms; the processor's time (of all threads) says the
same whatever else the machine does.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from tables import arguments, publish, table

from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model
from rhot_app.hand.skeleton import ANGLES, HandPose
from rhot_app.project import Rig, load_rig
from rhot_app.state import UNESTIMATED, Condition, HandState, Knowledge
from rhot_app.ui.app import cap_software_gl, choose_gl_platform
from rhot_node.files import resource_path

SIZE = (640, 480)
BATCH = 20
SD_M = np.array([0.0004, 0.0006, 0.0015])


@dataclass(frozen=True, slots=True)
class Cost:
    """s per redrawing: all of it, the posing of the meshes in it, and the processor's time for all of it."""

    redraw: float
    pose: float
    processor: float


def some_states(rig: Rig, count: int = 40) -> list[HandState]:
    """A hand that closes in front of the cameras."""
    model = build_model(rig.hand)
    return [_state(rig, forward(model, HandPose(_palm(), np.full(len(ANGLES), bend))), k)
            for k, bend in enumerate(np.linspace(0.1, 0.8, count))]


def _palm() -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3] = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    pose[:3, 3] = (0.03, 0.06, 0.55)
    return pose


def _state(rig: Rig, points, number: int) -> HandState:  # type: ignore[no-untyped-def]
    markers = np.vstack([points.marker_centres, points.joints[:1]])[:len(rig.markers.ids)]
    count, cameras = len(markers), len(rig.nodes)
    covariance = np.diag(SD_M**2)
    return HandState(
        sequence=number, t_master_ns=number, t_receive_ns=number, condition=Condition.TRACKING,
        marker_ids=rig.markers.ids, marker_positions=markers, marker_raw_positions=markers,
        marker_covariances=np.tile(covariance, (count, 1, 1)), marker_knowledge=np.arange(count, dtype=np.uint8) % 3,
        camera_names=tuple(node.name for node in rig.nodes), camera_pixels=np.zeros((cameras, count, 2)),
        camera_flags=np.zeros((cameras, count), np.uint16), joint_positions=points.joints,
        joint_knowledge=np.arange(21, dtype=np.uint8) % 3, fingertip_positions=points.marker_centres,
        angles=np.zeros(21), angle_knowledge=np.zeros(21, np.uint8), world_from_palm=_palm(),
        palm_knowledge=Knowledge.INFERRED, epipolar_error_px=np.zeros(count),
        latency_s={}, **UNESTIMATED | {
            "joint_covariances": np.tile(9 * covariance, (21, 1, 1)),
            "fingertip_covariances": np.tile(covariance, (5, 1, 1)), "angle_sd": np.full(21, 0.02),
            "palm_covariance": np.eye(6) * 1e-6})


def costs(redraws: int) -> Iterator[Cost]:
    """Draw so often, a batch at a time so that the machine's other work shows as scatter and not as a slow renderer."""
    from PySide6.QtTest import QTest

    from rhot_app.ui.models.palette import DARK
    from rhot_app.ui.scene.view import SceneView

    rig = load_rig(resource_path("rigs", "two_pis.json"))
    states = some_states(rig)
    scene = SceneView(DARK)
    scene.resize(*SIZE)
    scene.show_rig(rig)
    scene.show()
    QTest.qWaitForWindowExposed(scene)
    scene.show_state(states[0])
    scene.frame_hand()
    for number in range(redraws):
        begin, busy = time.perf_counter(), time.process_time()
        scene.show_state(states[number % len(states)])
        posed = time.perf_counter()
        scene.grabFramebuffer()  # to the last pixel; a mere repaint may leave work in the renderer's queue
        yield Cost(time.perf_counter() - begin, posed - begin, time.process_time() - busy)
    scene.close()


def main() -> int:
    """Measure and print."""
    parser = arguments(__doc__)
    parser.add_argument("--redraws", type=int, default=400)
    args = parser.parse_args()
    choose_gl_platform()
    cap_software_gl()
    from PySide6.QtCore import Qt
    from PySide6.QtWidgets import QApplication

    from rhot_app.ui.scene.surface import choose_format

    QApplication.setAttribute(Qt.ApplicationAttribute.AA_ShareOpenGLContexts)
    app = QApplication([])
    renderer = choose_format()
    found = list(costs(args.redraws + BATCH))[BATCH:]
    batches = [found[k:k + BATCH] for k in range(0, len(found), BATCH)]
    figures = {said: [1e3 * float(np.median([getattr(cost, name) for cost in batch])) for batch in batches]
               for name, said in (("redraw", "all of a redraw"), ("pose", "posing of the meshes in it"),
                                  ("processor", "processor time of all threads"))}
    publish(args, figures,
            table([f"{SIZE[0]} x {SIZE[1]} px, {renderer}", "median, ms", "best batch, ms"],
                  [[said, np.median(medians), min(medians)] for said, medians in figures.items()]))
    app.quit()
    return 0


if __name__ == "__main__":
    sys.exit(main())
