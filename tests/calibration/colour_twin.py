"""Colour calibrations on the digital twin: a hand on wood or cloth by any lamp, in any paint, and what is lost."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from dataclasses import dataclass

import msgspec
import numpy as np

from rhot_app.calibration.colour.colours import ColourResult, solve_colours
from rhot_app.calibration.colour.samples import ColourSamples
from rhot_app.simulator.film.scene_objects import SceneObject
from rhot_app.simulator.film.shot import make_renderer, make_shot
from rhot_app.simulator.render.body import SKIN_RGB, HandBody
from rhot_app.simulator.render.camera_controls import Lamp
from rhot_app.simulator.render.render import FrameRenderer
from rhot_app.simulator.scene.scene import Scene, make_scene, twin_defaults
from rhot_node.detect.colour import box_mask, colours_of
from rhot_node.detect.fast import FastDetector
from rhot_node.detect.image import YuvImage, from_i420
from rhot_node.markers import Marker, MarkerSet

LEARNT_KELVIN = 4300.0
SEEN = 0.5  # of a marker's area that must be in view for a person to see it as what it is
AWAY = 1.0  # of its radius from its place: another thing, or it and another
JOINED = 4.0  # radii that it is wide: it and another; a fingertip's paint is 2.7
RADIUS_M = 8e-3  # of a fingertip
WOOD_RGB = (142.0, 104.0, 70.0)
SKIN = SKIN_RGB


@dataclass(frozen=True)
class Frame:
    """A picture, and of every marker its visible part, where its centre is, (M, 2) px, and its radius, (M,) px."""

    image: YuvImage
    visible: np.ndarray
    places: np.ndarray
    radii: np.ndarray
    palm: tuple[float, float]


class HandScene:
    """One camera before a hand that moves, in one paint, whose lamp can be changed."""

    def __init__(self, background: str, seed: int, motion: str = "grasp", markers: MarkerSet | None = None) -> None:
        settings = msgspec.structs.replace(twin_defaults(), background=background)
        scene: Scene = make_scene(settings, seed)
        self.scene = scene if markers is None else dataclasses.replace(scene, markers=markers)
        shot = make_shot(self.scene, motion, 60.0)
        self._act: SceneObject = shot.scene_object
        self.source = shot.scene_object.source
        self.renderer: FrameRenderer = make_renderer(shot, 0)
        self._camera = self.scene.camera(0)
        self._readout_s = 1e-9 * self.scene.row_time_ns * self.scene.preset.height

    @property
    def markers(self) -> MarkerSet:
        """The paints that the hand wears."""
        return self.scene.markers

    def frames(self, times_s: np.ndarray, kelvin: float = LEARNT_KELVIN, brightness: float = 1.0) -> Iterator[Frame]:
        """Pictures by one lamp."""
        body = self._act.thing
        assert isinstance(body, HandBody)
        preset = self.scene.preset
        self.renderer.expose(dataclasses.replace(self.renderer.exposure,
                                                  lamp=Lamp(kelvin=kelvin, brightness=brightness)))
        for number, time_s in enumerate(times_s):
            data, visible = self.renderer.render(self.source, float(time_s), number)
            pose = self.source.sample(np.array([time_s + 0.5 * self._readout_s]))
            joints, centres = body.joints_and_markers(*pose)
            places = self._camera.project(centres[0])
            radii_m = np.array([1e-3 * marker.radius_mm if marker.radius_mm else RADIUS_M
                                for marker in self.markers.markers])
            depths_m = centres[0] @ self._camera.camera_from_world[2, :3] + self._camera.camera_from_world[2, 3]
            radii = radii_m * self._camera.intrinsics[0] / depths_m
            wrist, knuckle = self._camera.project(joints[0, [0, 9]])
            palm = 0.35 * wrist + 0.65 * knuckle
            yield Frame(from_i420(data.copy(), preset.width, preset.height), visible.copy(), places, radii,
                        (float(palm[0]), float(palm[1])))


def calibrate(scene: HandScene, times_s: np.ndarray, kelvin: float = LEARNT_KELVIN, half: int = 4) -> ColourResult:
    """Learn the colours as a person would: a box on every marker, one on the palm, then the hand moves."""
    first, *others = scene.frames(times_s, kelvin)
    collector = ColourSamples()
    for name, (x, y), part in zip(scene.markers.ids, first.places, first.visible, strict=True):
        if part > SEEN:
            collector.add(name, first.image, (round(x) - half, round(y) - half, round(x) + half, round(y) + half))
    for frame in others:
        collector.follow(frame.image)
    x, y = first.palm
    skin = box_mask(first.image, [(round(x) - 10, round(y) - 10, round(x) + 10, round(y) + 10)])
    return solve_colours(collector.samples, collector.views, skin=colours_of(first.image, skin), base=scene.markers)


@dataclass
class Tally:
    """How often each marker was in view, not found, found elsewhere only, and found after something else, (M,)."""

    visible: np.ndarray
    lost: np.ndarray
    misplaced: np.ndarray
    second: np.ndarray

    @property
    def failed(self) -> np.ndarray:
        """(M,) share of the pictures with the marker in view in which no candidate was where and as large as it is."""
        return (self.lost + self.misplaced) / np.maximum(self.visible, 1)


def tally(markers: MarkerSet, frames: list[Frame], stills: bool) -> Tally:
    """What the detector makes of the frames: as unrelated pictures, or as they follow each other."""
    result = Tally(*(np.zeros(len(markers.markers), dtype=int) for _ in range(4)))
    detector = FastDetector(markers)
    for frame in frames:
        if stills:
            detector.reset()
        seen = detector.detect(frame.image)
        for index, (part, place, radius) in enumerate(zip(frame.visible, frame.places, frame.radii, strict=True)):
            own = [mark for mark in seen if mark.index == index and mark.found]
            if part > SEEN:
                result.visible[index] += 1
                result.lost[index] += not own
                wrong = [math.dist((mark.x, mark.y), place) > AWAY * radius or mark.diameter > JOINED * radius
                         for mark in own]
                result.misplaced[index] += bool(own) and all(wrong)
                result.second[index] += bool(own) and wrong[0] and not all(wrong)
    return result


def repainted(markers: MarkerSet, name: str, towards: tuple[float, float, float], share: float) -> MarkerSet:
    """The set with one paint mixed with another colour."""
    def mix(marker: Marker) -> Marker:
        if marker.id != name:
            return marker
        red, green, blue = (round((1.0 - share) * own + share * other)
                            for own, other in zip(marker.display_rgb, towards, strict=True))
        return msgspec.structs.replace(marker, display_rgb=(red, green, blue))

    return MarkerSet(markers=tuple(mix(marker) for marker in markers.markers))
