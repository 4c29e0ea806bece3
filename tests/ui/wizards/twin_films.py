"""Two films of a rig of the digital twin: a board that is held here and there, then a hand with painted markers."""

from __future__ import annotations

from pathlib import Path

import cv2
import msgspec

from rhot_app.simulator.film.shot import make_renderer, make_shot
from rhot_app.simulator.scene.scene import Scene, make_scene, twin_defaults
from rhot_app.simulator.scene.scene_description import BoardShow, HandShow, Show
from rhot_node.detect.image import from_i420, to_bgr

FPS = 30.0
PARTS: tuple[tuple[Show, float, float], ...] = ((BoardShow(), 32.0, 2.3), (HandShow("roam"), 12.0, 1.0))
"""What is shown, s of the film, and how much faster than the twin moves it."""


def filmed_scene() -> Scene:
    """The simulated rig with cameras of a film's rate that read all rows at once."""
    settings = twin_defaults()
    preset = msgspec.structs.replace(settings.presets[settings.preset], fps=FPS, row_time_us=0.0)
    return make_scene(msgspec.structs.replace(settings, presets={settings.preset: preset}), 1)


def write_films(folder: Path) -> list[str]:
    """The films left.avi and right.avi in `folder`, of the same instants."""
    scene, paths = filmed_scene(), []
    size = scene.preset.width, scene.preset.height
    for camera, name in enumerate(scene.names):
        paths.append(str(folder / f"{name}.avi"))
        writer = cv2.VideoWriter(paths[-1], cv2.VideoWriter.fourcc(*"MJPG"), FPS, size)
        for show, seconds, speed in PARTS:
            shot = make_shot(scene, show, seconds)
            renderer = make_renderer(shot, camera)
            for number in range(round(seconds * FPS)):
                frame, _ = renderer.render(shot.scene_object.source, speed * number / FPS, number)
                writer.write(to_bgr(from_i420(frame, *size)))
        writer.release()
    return paths
