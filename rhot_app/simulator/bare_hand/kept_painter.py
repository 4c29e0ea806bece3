"""What a painter painted, kept in a file and read from there the next time: a study renders each sequence once."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_app.simulator.render.exposure_samples import FrameTime
from rhot_app.simulator.render.painter import Box, Image, Painter, PoseSource

Array = NDArray[np.float64]


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
        self._image, self._level = background.copy(), np.ones(3)

    @property
    def image(self) -> Image:
        """(3, H, W): what `paint` painted, the background elsewhere."""
        return self._image

    def relight(self, background: Image, level: Array) -> None:
        """Another light: the `background` as it is lit now, and factors (3,) on the grey levels of everything else."""
        self._image, self._level = background.copy(), level

    def paint(self, source: PoseSource, time: FrameTime, number: int) -> tuple[Box, Array]:
        """Paint the frame, or read it."""
        if self._painter is not None:
            (x0, y0, x1, y1), _ = self._painter.paint(source, time, number)
            image = self._painter.image[:, y0:y1, x0:x1]
            crop = np.clip(np.rint(image), 0.0, 255.0).astype(np.uint8).transpose(1, 2, 0)
            if self._path is not None:
                self._keep(self._path, number, (x0, y0), crop)
        else:
            assert self._file is not None
            name = next(name for name in self._file.namelist() if name.startswith(f"{number}_"))
            x0, y0 = (int(part) for part in name.split("_")[1:])
            data = np.frombuffer(self._file.read(name), np.uint8)
            crop = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR) if len(data) else np.zeros((0, 0, 3)), np.uint8)
            y1, x1 = y0 + crop.shape[0], x0 + crop.shape[1]
        self._image[:, y0:y1, x0:x1] = crop.transpose(2, 0, 1) * self._level[:, None, None]
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
