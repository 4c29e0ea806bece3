"""Pictures of markers by a renderer of their own, which shares no code with the twin or with the tests' drawing.

Discs and capsules in the display colours of the six-marker set lie before textured rooms. Edges are supersampled and
blurred by a lens. Red, green and blue have sensor noise. The pictures are full-range BT.601 YUV420; pixel (0, 0) is
the centre of the top-left one. Colours are grey levels of RGB. The Cramer-Rao bound of a marker's position is computed
from the same drawing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.image import YuvImage
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

Array = NDArray[np.float64]
Plane = NDArray[np.float32]

MARKERS = load_markers(resource_path("markers", "rhot6.json"))
WIDTH, HEIGHT = 640, 480
NOISE = 4.0  # grey levels of red, green and blue, standard deviation
LENS_SIGMA = 0.7  # px
BORDER = 20.0  # px from the frame's border: centres come no nearer
GAP = 6.0  # px between the outlines of two markers, at least
EDGE, FINE = 5, 6  # samples per pixel along each axis: of pictures, of the bound's differences
REACH = 4  # px that the lens spreads an edge by
SIZES = ("12", "16", "24", "40", "mixed")
SIZES_PX = (12.0, 40.0)  # of what is mixed
SHAPES = ("disc", "capsule", "mixed")
CAPSULE = (0.3, 1.0)  # half the straight part of a capsule, in radii
SHADING, BRIGHTNESS, TEXTURE = (0.0, 0.25), (0.7, 1.1), (0.5, 1.5)
SWAY, WOBBLE, SWAY_RAD, WOBBLE_RAD = 6.0, 1.2, 0.13, 0.31  # px, rad/frame: of all markers, of each
NEUTRAL_HUE, NEUTRAL_SPAN = math.radians(137.0), math.radians(8.0)  # of wood and skin: between yellow and red paint
CHROMA_MOST, NEUTRAL_CHROMA_MOST = 18.0, 36.0  # grey levels of a room's chroma: weaker than any paint

YCC = np.array([[0.299, 0.587, 0.114], [-0.168736, -0.331264, 0.5], [0.5, -0.418688, -0.081312]])


@dataclass(frozen=True)
class Shape:
    """A disc, or a capsule where `half_length` is not 0. Its brightness falls by `shading` in the direction `towards`.

    `x`, `y`: its centroid; `radius`, `half_length` px; `turn`, `towards` rad; `rgb` (3,) grey levels.
    """

    x: float
    y: float
    radius: float
    half_length: float
    turn: float
    rgb: tuple[float, float, float]
    shading: float
    towards: float

    @property
    def reach(self) -> float:
        """Greatest distance of the outline from the centroid, px."""
        return self.radius + self.half_length

    def painted(self, canvas: Plane, x0: int, y0: int, samples: int = EDGE) -> Plane:
        """(H, W, 3) the canvas, whose first pixel is (x0, y0), with the shape on it."""
        height, width = canvas.shape[:2]
        fine = (np.arange(samples) + 0.5) / samples - 0.5
        xs = (np.arange(x0, x0 + width)[:, None] + fine).ravel() - self.x
        ys = (np.arange(y0, y0 + height)[:, None] + fine).ravel() - self.y
        along = xs * math.cos(self.turn) + (ys * math.sin(self.turn))[:, None]
        across = (ys * math.cos(self.turn))[:, None] - xs * math.sin(self.turn)
        beyond = np.hypot(np.maximum(np.abs(along) - self.half_length, 0.0), across) - self.radius
        inside = np.clip(0.5 - samples * beyond, 0.0, 1.0).reshape(height, samples, width, samples)
        coverage = inside.mean(axis=(1, 3))[:, :, None]
        px, py = np.arange(x0, x0 + width) - self.x, np.arange(y0, y0 + height)[:, None] - self.y
        ramp = np.clip((px * math.cos(self.towards) + py * math.sin(self.towards)) / self.reach, -1.0, 1.0)
        light = (1.0 - 0.5 * self.shading * (1.0 + ramp))[:, :, None]
        return np.asarray(canvas + coverage * (np.array(self.rgb) * light - canvas), dtype=np.float32)


@dataclass(frozen=True)
class Picture:
    """What the camera would see without noise: `planes` are Y, Cb, Cr, not rounded."""

    planes: tuple[Plane, Plane, Plane]

    def expose(self, rng: np.random.Generator) -> YuvImage:
        """The picture with noise, rounded."""
        a, b = int(rng.integers(HEIGHT // 2)), int(rng.integers(WIDTH // 2))
        noisy = []
        for plane, noise, times in zip(self.planes, _noise_planes(), (2, 1, 1), strict=True):
            height, width = plane.shape
            level = plane + noise[times * a:times * a + height, times * b:times * b + width]
            noisy.append(np.clip(np.rint(level), 0.0, 255.0).astype(np.uint8))
        return YuvImage(*noisy)


@dataclass(frozen=True)
class Scene:
    """Six markers, in the order of the set, before a room. `room` (H, W, 3) RGB, before the lens."""

    shapes: tuple[Shape, ...]
    room: Plane
    name: str

    def at(self, frame: float) -> tuple[Shape, ...]:
        """The markers in a later frame: they sway together, and each a little by itself, by less than 2 px a frame."""
        x, y = SWAY * math.sin(SWAY_RAD * frame), SWAY * (math.cos(0.83 * SWAY_RAD * frame) - 1.0) / 2.0
        return tuple(replace(shape, x=shape.x + x + WOBBLE * math.sin(WOBBLE_RAD * frame + k) - WOBBLE * math.sin(k),
                             y=shape.y + y) for k, shape in enumerate(self.shapes))

    def picture(self, frame: float = 0.0, hidden: Sequence[int] = ()) -> Picture:
        """The picture of a frame, without the markers `hidden`."""
        canvas, clean = self.room.copy(), self._clean_room
        planes = tuple(plane.copy() for plane in clean)
        shown = [shape for k, shape in enumerate(self.at(frame)) if k not in hidden]
        boxes = [_box(shape) for shape in shown]
        for shape, (x0, y0, x1, y1) in zip(shown, boxes, strict=True):
            canvas[y0:y1, x0:x1] = shape.painted(canvas[y0:y1, x0:x1], x0, y0)
        for x0, y0, x1, y1 in boxes:
            u0, v0, u1, v1 = (max(x0 - REACH, 0), max(y0 - REACH, 0), min(x1 + REACH, WIDTH), min(y1 + REACH, HEIGHT))
            seen = through_lens(canvas[v0:v1, u0:u1])[y0 - v0:y1 - v0, x0 - u0:x1 - u0]
            y, cb, cr = to_planes(seen)
            planes[0][y0:y1, x0:x1] = y
            planes[1][y0 // 2:y1 // 2, x0 // 2:x1 // 2], planes[2][y0 // 2:y1 // 2, x0 // 2:x1 // 2] = cb, cr
        return Picture(planes)  # type: ignore[arg-type]

    @cached_property
    def _clean_room(self) -> tuple[Plane, Plane, Plane]:
        return to_planes(through_lens(self.room))

    def place_bound(self, index: int) -> Array:
        """(2,) px: the least standard deviations of x and y of one marker in a frame's chroma planes.

        Also unknown: radius, length and turn, the paint, strength and direction of the shading, and the
        surroundings' mean colour.
        """
        shape = self.shapes[index]
        x0, y0, x1, y1 = _box(shape)

        def chroma(change: Array) -> Array:
            x, y, radius, half, turn, red, green, blue, shading, towards = change[:10].tolist()
            changed = replace(shape, x=shape.x + x, y=shape.y + y, radius=shape.radius + radius,
                              half_length=shape.half_length + half, turn=shape.turn + turn,
                              rgb=tuple(np.add(shape.rgb, (red, green, blue)).tolist()),
                              shading=shape.shading + shading, towards=shape.towards + towards)
            room = self.room[y0:y1, x0:x1] + change[10:].astype(np.float32)
            _, cb, cr = to_planes(through_lens(changed.painted(room, x0, y0, FINE)))
            return np.stack([cb.ravel(), cr.ravel()], axis=-1).astype(np.float64)

        steps = np.array([0.2, 0.2, 0.2, 0.2, 0.05, 4.0, 4.0, 4.0, 0.05, 0.05, 4.0, 4.0, 4.0])
        if shape.half_length == 0.0:
            steps[3:5] = 0.0  # a disc is known to be one
        slopes = np.stack([(chroma(step * unit) - chroma(-step * unit)) / (2.0 * step)
                           for step, unit in zip(steps, np.eye(len(steps)), strict=True) if step > 0.0], axis=-1)
        covariance = 0.25 * NOISE**2 * YCC[1:] @ YCC[1:].T + np.eye(2) / 12.0
        information = np.einsum("nik,ij,njl->kl", slopes, np.linalg.inv(covariance), slopes)
        others = np.linalg.pinv(information[2:, 2:], rcond=1e-9)
        place = information[:2, :2] - information[:2, 2:] @ others @ information[2:, :2]
        return np.asarray(np.sqrt(np.diag(np.linalg.inv(place))))


def _box(shape: Shape) -> tuple[int, int, int, int]:
    """x0, y0, x1, y1, even: the part of the picture that a marker changes."""
    reach = shape.reach + REACH
    return (max(2 * math.floor((shape.x - reach) / 2), 0), max(2 * math.floor((shape.y - reach) / 2), 0),
            min(2 * math.ceil((shape.x + reach) / 2), WIDTH), min(2 * math.ceil((shape.y + reach) / 2), HEIGHT))


def through_lens(rgb: Plane) -> Plane:
    """RGB blurred by the lens."""
    return np.asarray(cv2.GaussianBlur(rgb, (0, 0), LENS_SIGMA), dtype=np.float32)


def to_planes(rgb: Plane) -> tuple[Plane, Plane, Plane]:
    """Y, Cb and Cr of RGB, chroma averaged over 2x2, not rounded."""
    height, width = rgb.shape[:2]
    half = rgb.reshape(height // 2, 2, width // 2, 2, 3).mean(axis=(1, 3))
    y, cb, cr = (np.asarray(source @ row.astype(np.float32), dtype=np.float32)
                 for source, row in zip((rgb, half, half), YCC, strict=True))
    return y, cb + np.float32(128.0), cr + np.float32(128.0)


@cache
def _noise_planes() -> tuple[Plane, Plane, Plane]:
    """Noise of Y, Cb and Cr, twice as wide and high as a picture, which takes its noise from a random part of it."""
    rgb = NOISE * np.random.default_rng(0).standard_normal((2 * HEIGHT, 2 * WIDTH, 3), dtype=np.float32)
    y, cb, cr = to_planes(rgb)
    return y, cb - np.float32(128.0), cr - np.float32(128.0)


# Rooms ------------------------------------------------------------------------------------------------------------

def _waves(rng: np.random.Generator, cell_x: float, cell_y: float) -> Array:
    """(H, W) smooth noise with a standard deviation of 1 and the given wavelength, px."""
    coarse = rng.standard_normal((math.ceil(HEIGHT / cell_y) + 2, math.ceil(WIDTH / cell_x) + 2))
    waves = cv2.resize(coarse, (WIDTH, HEIGHT), interpolation=cv2.INTER_CUBIC)
    return np.asarray(waves / waves.std(), dtype=np.float64)


def _grid() -> tuple[Array, Array]:
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float64)
    return columns, rows


def _grey(rng: np.random.Generator, strength: float) -> Array:
    """A wall with light from one side."""
    (x, y), turn, (dark, bright) = _grid(), rng.uniform(0.0, math.tau), (rng.uniform(50, 110), rng.uniform(130, 200))
    ramp = (x / WIDTH - 0.5) * math.cos(turn) + (y / HEIGHT - 0.5) * math.sin(turn) + 0.5
    return (dark + (bright - dark) * ramp + 3.0 * strength * _waves(rng, 5, 5))[:, :, None] * np.array([1.0, 1.0, 0.98])


def _blotches(rng: np.random.Generator, strength: float) -> Array:
    """Smooth random texture of several sizes, weakly coloured."""
    luma = 115.0 + strength * (18 * _waves(rng, 70, 70) + 10 * _waves(rng, 18, 18) + 6 * _waves(rng, 5, 5))
    return np.stack([luma + 5.0 * strength * _waves(rng, 60, 60) for _ in range(3)], axis=-1)


def _wood(rng: np.random.Generator, strength: float) -> Array:
    """Boards with a grain."""
    x, y = _grid()
    if rng.random() < 0.5:
        x, y = y, x
    grain = np.sin((y + 18.0 * _waves(rng, 250, 90)) / rng.uniform(2.0, 5.0)) + 0.7 * _waves(rng, 90, 3)
    tone = (1.0 + 0.09 * strength * grain + 0.06 * _waves(rng, 200, 60)) * np.where(y % 150 < 2.0, 0.7, 1.0)
    return tone[:, :, None] * np.array([150.0, 110.0, 75.0]) * rng.uniform(0.7, 1.1)


def _cloth(rng: np.random.Generator, strength: float) -> Array:
    """A weave with folds, tinted by a hue of its own."""
    (x, y), turn, hue, period = _grid(), rng.uniform(0, math.pi), rng.uniform(0, math.tau), rng.uniform(3.5, 8.0)
    a, b = x * math.cos(turn) + y * math.sin(turn), y * math.cos(turn) - x * math.sin(turn)
    weave = np.sin(math.tau * a / period) * np.sin(math.tau * b / period)
    tone = 1.0 + strength * (0.12 * weave + 0.12 * _waves(rng, 110, 110) + 0.03 * _waves(rng, 3, 3))
    tint = np.linalg.inv(YCC) @ np.array([rng.uniform(80, 150), 14.0 * math.cos(hue), 14.0 * math.sin(hue)])
    return tone[:, :, None] * tint


def _brown(rng: np.random.Generator, strength: float) -> Array:
    """A brownish room: leather and cardboard in patches."""
    tone = 1.0 + strength * (0.16 * _waves(rng, 120, 120) + 0.07 * _waves(rng, 20, 20) + 0.04 * _waves(rng, 4, 4))
    pale = np.clip(0.5 + 0.25 * strength * _waves(rng, 100, 100), 0.0, 1.0)[:, :, None]
    return tone[:, :, None] * (pale * np.array([140.0, 114.0, 92.0]) + (1.0 - pale) * np.array([118.0, 104.0, 94.0]))


ROOMS: dict[str, Callable[[np.random.Generator, float], Array]] = {
    "grey": _grey, "blotches": _blotches, "wood": _wood, "cloth": _cloth, "brown": _brown}


def _room(kind: str, rng: np.random.Generator, strength: float) -> Array:
    """(H, W, 3) RGB whose chroma is weaker than any paint's: somewhat stronger only in the hue of wood."""
    y, cb, cr = np.moveaxis(ROOMS[kind](rng, strength) @ YCC.T, -1, 0)
    neutral = np.abs(np.arctan2(cr, cb) - NEUTRAL_HUE) < NEUTRAL_SPAN
    most = np.where(neutral, NEUTRAL_CHROMA_MOST, CHROMA_MOST)
    factor = np.minimum(1.0, most / np.maximum(np.hypot(cb, cr), 1e-9))
    return np.clip(np.stack([y, factor * cb, factor * cr], axis=-1) @ np.linalg.inv(YCC).T, 0.0, 250.0)


# Layouts ----------------------------------------------------------------------------------------------------------

OPEN_HAND = np.array([[-1.0, 0.15], [-0.55, -0.85], [-0.1, -1.0], [0.32, -0.9], [0.72, -0.55], [0.05, 1.0]])
"""Thumb, index, middle, ring, little, wrist."""
TRIES = 4000


def _compact(rng: np.random.Generator, reach: Array) -> Array:
    """Positions within a few marker sizes of each other."""
    room, margin = 2.5 * float(np.mean(reach)), float(reach.max()) + SWAY + 2 * WOBBLE
    while True:
        within = room + margin
        centre = np.array([rng.uniform(min(within, WIDTH / 2), max(WIDTH - within, WIDTH / 2)),
                           rng.uniform(min(within, HEIGHT / 2), max(HEIGHT - within, HEIGHT / 2))])
        for _ in range(TRIES // 40):
            places = centre + room * np.sqrt(rng.uniform(0, 1, (6, 1))) * _directions(rng)
            if _apart(places, reach):
                return places
        room *= 1.1


def _hand(rng: np.random.Generator, reach: Array) -> Array:
    """Positions as on an open hand that fills the frame, at a random rotation."""
    while True:
        turn = rng.uniform(0, math.tau)
        hand = (OPEN_HAND + rng.normal(0.0, 0.08, OPEN_HAND.shape)) @ np.array(
            [[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
        low, high = hand.min(axis=0), hand.max(axis=0)
        low_px, high_px = _limits(reach.max())
        scale = float(((high_px - low_px) / (high - low)).min())
        slack = (high_px - low_px) - scale * (high - low)
        places = low_px + scale * (hand - low) + slack * rng.uniform(0, 1, 2)
        if _apart(places, reach):
            return places


def _spread(rng: np.random.Generator, reach: Array) -> Array:
    """Random positions, two of them in opposite corners."""
    while True:
        low, high = _limits(reach)
        places = low + (high - low) * rng.uniform(0, 1, (6, 2))
        one, other = rng.choice(6, 2, replace=False)
        left = rng.random() < 0.5
        places[one], places[other] = low[one], high[other]
        if left:
            places[one, 0], places[other, 0] = high[one, 0], low[other, 0]
        if _apart(places, 1.5 * reach):
            return places


def _limits(reach: Array | float) -> tuple[Array, Array]:
    """Least and greatest positions: BORDER px from the frame's border and the outline inside it, in all frames."""
    away = np.maximum(BORDER, np.atleast_1d(reach) + 2.0)[:, None] + SWAY + 2 * WOBBLE
    low, high = away * np.ones(2), np.array([WIDTH - 1.0, HEIGHT - 1.0]) - away
    return (low, high) if np.ndim(reach) else (low[0], high[0])


def _directions(rng: np.random.Generator) -> Array:
    angles = rng.uniform(0, math.tau, 6)
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def _apart(places: Array, reach: Array) -> bool:
    distance = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1)) + 1e6 * np.eye(len(places))
    return bool((distance >= reach[:, None] + reach[None] + GAP + 2 * WOBBLE).all())


LAYOUTS: dict[str, Callable[[np.random.Generator, Array], Array]] = {
    "compact": _compact, "hand": _hand, "spread": _spread}


def build_scene(layout: str, size: str, room: str, seed: int, shapes: str = "mixed") -> Scene:
    """A scene of a layout, a size (px, or "mixed"), a room and a seed; the rest is random within the ranges above.

    `size` is a disc's diameter, a capsule's width.
    """
    rng = np.random.default_rng(seed)
    count = len(MARKERS.markers)
    radii = 0.5 * (rng.uniform(*SIZES_PX, count) if size == "mixed" else np.full(count, float(size)))
    long = {"disc": np.zeros(count), "capsule": np.ones(count), "mixed": rng.integers(0, 2, count)}[shapes]
    halves = radii * rng.uniform(*CAPSULE, count) * long
    places = LAYOUTS[layout](rng, radii + halves)
    bright = float(rng.uniform(*BRIGHTNESS))
    drawn = tuple(Shape(float(x), float(y), float(radius), float(half), float(rng.uniform(0, math.pi)),
                        tuple(bright * level for level in marker.display_rgb),  # type: ignore[arg-type]
                        float(rng.uniform(*SHADING)), float(rng.uniform(0, math.tau)))
                  for (x, y), radius, half, marker in zip(places, radii, halves, MARKERS.markers, strict=True))
    return Scene(drawn, (bright * _room(room, rng, float(rng.uniform(*TEXTURE)))).astype(np.float32),
                 f"{layout} {size} {room} {shapes} seed {seed}")
