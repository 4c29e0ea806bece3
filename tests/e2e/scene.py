"""A hand of six coloured discs before the bench's two cameras, drawn to raw recordings that nodes can play.

Plainer than the digital twin on purpose: it shares no code with it, so that both would have to be wrong alike.
"""

from __future__ import annotations

import math
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from bench import FPS, HEIGHT, WIDTH, Bench
from numpy.typing import NDArray

from rhot_app.hand.kinematics import forward
from rhot_app.hand.model import build_model, neutral_pose
from rhot_app.project import Rig, RigNode
from rhot_node.capture.yuv import YuvWriter
from rhot_node.markers import MarkerSet

Array = NDArray[np.float64]

EXPOSURE_NS = 4_000_000
ROW_TIME_NS = 48_000
DISTANCE_M = 0.6
RADIUS_PX = 8.0
PERIOD_S = 2.0  # one swing; recordings are cut to whole swings so that they loop without a jump


@dataclass(frozen=True)
class Scene:
    """A relaxed right hand, fingers up, that swings sideways by `amplitude_m`."""

    rig: Rig
    amplitude_m: float = 0.0

    def markers_m(self, t_s: float) -> Array:
        """(6, 3) marker centres at a time since the recording's start: fingertips, then wrist."""
        sideways_m = self.amplitude_m * math.sin(2.0 * math.pi * t_s / PERIOD_S)
        world_from_palm = np.array([[0.0, 1.0, 0.0, 0.03 + sideways_m], [-1.0, 0.0, 0.0, 0.08],
                                    [0.0, 0.0, 1.0, DISTANCE_M], [0.0, 0.0, 0.0, 1.0]])
        points = forward(build_model(self.rig.hand), neutral_pose(world_from_palm))
        return np.vstack([points.marker_centres, points.joints[0]])

    def pixels(self, node: RigNode, t_row0_s: float) -> Array:
        """(6, 2) px: where a camera with a rolling shutter sees them in the frame whose row 0 is at this time."""
        pixels = project(node, self.markers_m(t_row0_s))
        for row, (_, y) in enumerate(pixels):
            pixels[row] = project(node, self.markers_m(t_row0_s + 1e-9 * ROW_TIME_NS * y))[row]
        return pixels

    def record(self, folder: Path, node: RigNode, seconds: float) -> None:
        """Draw what `node` sees from time 0 on."""
        with YuvWriter(folder, WIDTH, HEIGHT, EXPOSURE_NS, ROW_TIME_NS) as writer:
            for frame in range(round(seconds * FPS)):
                t_s = frame / FPS
                writer.append(round(1e9 * t_s), draw(self.pixels(node, t_s), self.rig.markers))


def start_still_hand(bench: Bench) -> tuple[subprocess.Popen[bytes], list[subprocess.Popen[bytes]]]:
    """An engine and both nodes, before whose cameras a hand holds still."""
    for node in bench.rig.nodes:
        Scene(bench.rig).record(bench.folder / f"{node.name}.yuv", node, 0.5)
    engine = bench.start_engine("--start")
    return engine, [bench.start_node(index, f"yuv:{bench.folder / node.name}.yuv")
                    for index, node in enumerate(bench.rig.nodes)]


def project(node: RigNode, points_m: Array) -> Array:
    """(N, 2) px of (N, 3) m; the bench's cameras look along z without distortion."""
    local = points_m - np.array(node.pose.translation_m)
    focal = np.array([node.intrinsics.fx, node.intrinsics.fy])
    return local[:, :2] / local[:, 2:] * focal + np.array([node.intrinsics.cx, node.intrinsics.cy])


def draw(pixels: Array, markers: MarkerSet) -> NDArray[np.uint8]:
    """Packed I420 with a soft-edged disc of each marker's colour on grey."""
    luma = np.full((HEIGHT, WIDTH), 128, np.uint8)
    chroma = np.full((2, HEIGHT // 2, WIDTH // 2), 128.0)
    reach = 2 * math.ceil(RADIUS_PX / 2 + 1)  # px, even: the patch keeps to whole chroma samples
    for (x, y), marker in zip(pixels, markers.markers, strict=True):
        left, top = 2 * round(x / 2) - reach, 2 * round(y / 2) - reach
        rows, columns = np.mgrid[top:top + 2 * reach, left:left + 2 * reach]
        cover = np.clip(RADIUS_PX + 0.5 - np.hypot(columns - x, rows - y), 0.0, 1.0)
        half = cover.reshape(reach, 2, reach, 2).mean(axis=(1, 3))
        patch = chroma[:, top // 2:top // 2 + reach, left // 2:left // 2 + reach]
        patch += np.array([marker.chroma.cb, marker.chroma.cr])[:, None, None] * half
    return np.concatenate([luma.ravel(), np.clip(chroma.round(), 0, 255).astype(np.uint8).ravel()])
