"""What a painter is: it puts something that moves over the background of one camera, at the times of a frame. One keeps
what another one painted, so that a study renders each sequence once.
"""

from __future__ import annotations

import os
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.simulator.render.body import Solids
from rhot_app.simulator.render.exposure_samples import FrameTime
from rhot_node.pictures import decode_picture

Array = NDArray[np.float64]
Image = NDArray[np.float32]
Box = tuple[int, int, int, int]
"""Pixels x0 <= x < x1, y0 <= y < y1; (0, 0, 0, 0) when there are none."""


class PoseSource(Protocol):
    """Anything that says where the thing shown is at a time."""

    def sample(self, times_s: Array) -> tuple[Array, Array]:
        """world_from_palm (T, 4, 4) m, or of whatever is shown, and a hand's angles (T, 21) rad (others: (T, 0)) at
        times (T,) s of the scene."""
        ...


class Body(Protocol):
    """Capsules and cylinders that some pose places in the world."""

    @property
    def solids(self) -> Solids: ...
    @property
    def marker_count(self) -> int: ...

    def place(self, transforms: Array, angles: Array) -> Array:
        """(T, N, 12) parameters of the solids for poses (T, 4, 4) and angles (T, A)."""
        ...

    def marker_positions(self, transforms: Array, angles: Array) -> Array:
        """(T, M, 3) m, the centres of the set's markers; NaN for those that are not there."""
        ...


@dataclass(frozen=True, slots=True)
class LitImage:
    """What a camera sees before lens and sensor, as grey levels (3, H, W): the `background` as it is lit, and the
    `image`, which is the background until something is painted into it. `level` (3,): the light's factors on the grey
    levels of everything else."""

    background: Image
    image: Image
    level: Array


def lit_image(background: Image, level: Array) -> LitImage:
    """An image with nothing before its `background`, which is given as grey levels of full light."""
    lit = np.ascontiguousarray(background * np.asarray(level)[:, None, None], dtype=np.float32)
    return LitImage(lit, lit.copy(), level)


class Painter(Protocol):
    """Paints one kind of thing before one camera. Holds work space: one thread only."""

    def paint(self, lit: LitImage, source: PoseSource, time: FrameTime, number: int) -> tuple[Box, Array]:
        """Paint frame `number` as `source` moves the thing; returns what may differ from the background, and the
        markers' visible parts (M,)."""
        ...


class KeptPainter:
    """A `Painter` that keeps what another one painted in a file, and reads it from there the next time.

    Levels are rounded to 8 bits, finer than the noise that the sensor adds. The file appears when the last frame is
    there. Another light is a factor on what was kept.
    """

    def __init__(self, make: Callable[[], Painter], background: Image, path: Path | None, count: int) -> None:
        """`make` is only called when there is no file at `path` yet. `count`: frames of the sequence."""
        self._path, self._count = path, count
        self._file = zipfile.ZipFile(path) if path is not None and path.is_file() else None
        self._painter = None if self._file else make()
        self._kept: dict[str, bytes] = {}
        self._full = lit_image(background, np.ones(3))

    def paint(self, lit: LitImage, source: PoseSource, time: FrameTime, number: int) -> tuple[Box, Array]:
        """Paint the frame, or read it."""
        if self._painter is not None:
            (x0, y0, x1, y1), _ = self._painter.paint(self._full, source, time, number)
            image = self._full.image[:, y0:y1, x0:x1]
            crop = np.clip(np.rint(image), 0.0, 255.0).astype(np.uint8).transpose(1, 2, 0)
            if self._path is not None:
                self._keep(self._path, number, (x0, y0), crop)
        else:
            assert self._file is not None
            name = next(name for name in self._file.namelist() if name.startswith(f"{number}_"))
            x0, y0 = (int(part) for part in name.split("_")[1:])
            data = self._file.read(name)
            crop = decode_picture(data) if data else np.zeros((0, 0, 3), np.uint8)
            y1, x1 = y0 + crop.shape[0], x0 + crop.shape[1]
        lit.image[:, y0:y1, x0:x1] = crop.transpose(2, 0, 1) * lit.level[:, None, None]
        return (x0, y0, x1, y1) if x0 < x1 else (0, 0, 0, 0), np.zeros(0)

    def _keep(self, path: Path, number: int, corner: tuple[int, int], crop: NDArray[np.uint8]) -> None:
        data = cv2.imencode(".png", crop)[1].tobytes() if crop.size else b""
        self._kept[f"{number}_{corner[0]}_{corner[1]}"] = data
        if len(self._kept) < self._count:
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        unfinished = path.with_suffix(f".{os.getpid()}")
        with zipfile.ZipFile(unfinished, "w") as file:
            for name, data in self._kept.items():
                file.writestr(name, data)
        unfinished.replace(path)
