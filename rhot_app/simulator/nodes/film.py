"""Film a shot to disk: both cameras' frames as raw YUV recordings, one process per camera, and the truth.

Beside them lie a rig file and each node's settings with ports of their own, so that the shot can be played to real
daemons on one machine (docs/twin.md).
"""

from __future__ import annotations

import contextlib
import functools
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rhot_app.errors import SimulatorError
from rhot_app.simulator.nodes.camera_workers import Progress, Report, for_each_camera
from rhot_app.simulator.nodes.shot import Shot, make_renderer, save_shot
from rhot_app.simulator.truth.truth import FrameTruth, save_truth, true_object
from rhot_node.capture.yuv import YuvWriter

TRUTH_NAME = "truth.npz"


def film(shot: Shot, folder: Path, progress: Progress | None = None) -> None:
    """Render the shot into the new `folder`: one recording per camera, ``truth.npz``, ``rig.json``, ``shot.json``, and
    the nodes' settings in ``NAME.json``, their ports those of the rig file.

    The folder appears only when all is complete; an interrupt or error leaves nothing behind. Raises SimulatorError.
    """
    with new_folder(folder) as work:
        cameras = for_each_camera(shot, functools.partial(_write_frames, work), progress)
        save_truth(work / TRUTH_NAME, true_object(shot.scene_object, shot.seconds, cameras))
        save_shot(shot, work)


@contextlib.contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """A hidden folder that becomes `folder` when the block ends, or vanishes when it fails. Raises SimulatorError when
    `folder` exists or has no place."""
    if folder.exists():
        raise SimulatorError(f"{folder} exists already; choose another folder or remove it.")
    if not folder.parent.is_dir():
        raise SimulatorError(f"{folder.parent} is not a folder; create it first.")
    work = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}."))
    try:
        yield work
        work.chmod(0o755)
        work.replace(folder)
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _write_frames(folder: Path, shot: Shot, index: int, report: Report) -> FrameTruth:
    """All frames of one camera, and their truth."""
    scene, preset = shot.scene, shot.scene.preset
    times = scene.frame_times_ns(index, shot.seconds)
    renderer = make_renderer(shot, index)
    visible = []
    with YuvWriter(folder / scene.names[index], preset.width, preset.height, scene.exposure_ns,
                   scene.row_time_ns) as writer:
        for number, t_ns in enumerate(times):
            frame, fractions = renderer.render(shot.scene_object.source, 1e-9 * t_ns, number)
            writer.append(t_ns, frame)
            visible.append(fractions.copy())
            report(number)
    return FrameTruth(1e-9 * np.array(times), np.array(visible))
