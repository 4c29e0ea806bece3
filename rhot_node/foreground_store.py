"""What a node has learnt of the empty scene and of the hand's colours: in force, and in a file beside its settings."""

from __future__ import annotations

import functools
import io
import logging
import threading
import time
import zipfile
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from rhot_node.detect.foreground import (
    BINS,
    BackgroundSums,
    Foreground,
    foreground_map,
    learn_skin,
    no_foreground,
    skin_foreground,
)
from rhot_node.detect.image import YuvImage, to_bgr
from rhot_node.errors import NodeError
from rhot_node.files import open_archive, write_atomically
from rhot_node.network.pictures import Encoded, Picture, PictureBox
from rhot_node.threads import OneShotThread

log = logging.getLogger(__name__)

PICTURES_MIN: Final = 4
"""Pictures that a background needs at least: a pixel's noise is then known to 1/sqrt(2 n), 35 %."""

MASK_STEP: Final = 2
"""Pixels of the picture to one of the mask."""

_FORMAT = np.array("rhot-foreground 1")
_FLAT, _GENERIC = no_foreground(), skin_foreground()


def foreground_path(settings: Path) -> Path:
    """Where the node with this settings file keeps what it has learnt."""
    return settings.with_name(f"{settings.stem}.foreground.npz")


def rgb_of(image: YuvImage) -> NDArray[np.uint8]:
    """(H, W, 3) RGB."""
    return np.ascontiguousarray(to_bgr(image)[:, :, ::-1])


class ForegroundStore:
    """The foreground model in force. `current` may be read by any thread; the control thread and the one that
    learns change it."""

    def __init__(self, path: Path | None) -> None:
        """Reads `path` if there is one; what cannot be read is reported and counts as nothing."""
        self.path = path
        self.current = _FLAT
        self._failure = ""
        self._until_s = 0.0
        self._task: OneShotThread | None = None
        self._ending = threading.Event()  # of the thread
        self._changing = threading.Lock()
        if path is not None and path.exists():
            try:
                self.current = load_foreground(path)
            except NodeError as exc:
                self._failure = str(exc)
                log.error("%s", exc)

    def of_size(self, width: int, height: int) -> Foreground:
        """The model for pictures of this size, px: a background of another size is left out."""
        model = self.current
        if model.mean.size and model.mean.shape[:2] != (height, width):
            return model._replace(mean=_FLAT.mean, sd=_FLAT.sd)
        return model

    def report(self, width: int, height: int) -> dict[str, Any]:
        """What is known, for the node's state; `width`, `height`: of the camera's pictures, px."""
        model, problem = self.current, self._failure
        known = self.of_size(width, height)
        if model.mean.size and not known.mean.size and not problem:
            rows, columns = model.mean.shape[:2]
            problem = (f"The background was learnt from pictures of {columns} x {rows} px, and the camera gives "
                       f"{width} x {height} px: learn it again.")
        return {"sentence": known.sentence, "background": bool(known.mean.size), "skin": _skin_of(known),
                "learning_s": max(0.1, self._until_s - time.monotonic()) if self.learning else 0.0,
                "problem": problem}

    @property
    def learning(self) -> bool:
        """Whether a background is being learnt."""
        return self._task is not None and self._task.running

    def learn_background(self, pictures: PictureBox, seconds: float, *, save: bool = True) -> None:
        """Begin to learn the scene as it is during the next seconds; with `save` False it is in force until the node
        ends or `revert`. Raises NodeError while that goes on already."""
        self._require_idle()
        self._failure, self._until_s, self._ending = "", time.monotonic() + seconds, threading.Event()
        learn = functools.partial(self._learn, pictures, save, self._until_s, self._ending)
        self._task = OneShotThread("learns the background", learn)

    def learn_skin(self, pictures: PictureBox, *, save: bool = True) -> bool:
        """Learn the skin's colours from the next picture. False when it shows no skin; generic colours are then used.
        `save` as in `learn_background`. Raises NodeError without a picture, or when the file cannot be written."""
        self._require_idle()
        image = rgb_of(pictures.still().image)
        model = self.of_size(image.shape[1], image.shape[0])
        self._use(learn_skin(image, model), save=save)
        return _skin_of(self.current) == "learnt"

    def save(self) -> None:
        """Keep what is in force; what was kept before can be brought back by `revert`. Raises NodeError."""
        self._require_idle()
        if self.path is not None:
            try:
                if self.path.exists():
                    write_atomically(self._before(), self.path.read_bytes())
                else:
                    self._before().unlink(missing_ok=True)
            except OSError as exc:
                raise NodeError(f"{self._before()}: cannot be written ({exc.strerror}); nothing was changed.") from exc
        self._use(self.current, save=True)

    def revert(self, *, earlier: bool = False) -> None:
        """Use what is in the file again; a background that is being learnt is given up. `earlier`: use what was there
        before the last `save`, and once more, what that had saved. Raises NodeError."""
        if earlier:
            self._require_idle()
        with self._changing:
            self._ending.set()
            self._task = None
        if earlier and self.path is not None:
            kept, saved = self._before(), self.path.read_bytes() if self.path.exists() else None
            self._use(load_foreground(kept) if kept.exists() else _FLAT, save=True)
            try:
                if saved is not None:
                    write_atomically(kept, saved)
            except OSError as exc:
                raise NodeError(f"{kept}: cannot be written ({exc.strerror}).") from exc
            return
        known = self.path is not None and self.path.exists()
        self.current, self._failure = load_foreground(self.path) if known and self.path is not None else _FLAT, ""

    def _require_idle(self) -> None:
        if self.learning:
            raise NodeError("the background is being learnt already; wait for its end.")

    def _before(self) -> Path:
        assert self.path is not None
        return self.path.with_suffix(".before.npz")

    def forget(self) -> None:
        """Know nothing any more. Raises NodeError while a background is being learnt, or when the file cannot be
        removed."""
        self._require_idle()
        try:
            if self.path is not None:
                self.path.unlink(missing_ok=True)
        except OSError as exc:
            raise NodeError(f"{self.path}: cannot be removed ({exc.strerror}).") from exc
        self.current, self._failure = _FLAT, ""

    def mask(self, pictures: PictureBox) -> tuple[Encoded, Picture]:
        """The foreground probabilities, 0 to 255, of every MASK_STEP-th pixel of the next picture, as PNG, and this
        picture. Raises NodeError without a picture."""
        picture = pictures.still()
        image = rgb_of(picture.image)
        probability = foreground_map(image, self.of_size(image.shape[1], image.shape[0]), MASK_STEP)
        _, data = cv2.imencode(".png", np.round(255.0 * probability).astype(np.uint8),
                               [cv2.IMWRITE_PNG_COMPRESSION, 1])
        return Encoded(data.tobytes(), probability.shape[1], probability.shape[0]), picture

    def close(self) -> None:
        """End what is being learnt."""
        self._ending.set()
        if self._task is not None:
            self._task.join()

    def _learn(self, pictures: PictureBox, save: bool, until_s: float, ending: threading.Event) -> None:
        sums = BackgroundSums()
        try:
            while time.monotonic() < until_s or sums.count < PICTURES_MIN:
                if ending.is_set():
                    return
                sums.add(rgb_of(pictures.still().image))
            with self._changing:
                if ending.is_set():
                    return
                self._use(sums.learnt(self.current if _skin_of(self.current) != "none" else _GENERIC), save=save)
            log.info("the background was learnt from %d pictures", sums.count)
        except (NodeError, ValueError) as exc:
            if not ending.is_set():
                self._failure = f"The background was not learnt: {exc}"
                log.error("%s", self._failure)

    def _use(self, model: Foreground, *, save: bool) -> None:
        """Keep the model if `save`, then use it as it is read. Raises NodeError when the file cannot be written."""
        halved = model._replace(mean=model.mean.astype(np.float16), sd=model.sd.astype(np.float16))
        if save and self.path is not None:
            file = io.BytesIO()
            np.savez(file, format=_FORMAT, **halved._asdict())
            try:
                write_atomically(self.path, file.getvalue())
            except OSError as exc:
                raise NodeError(f"{self.path}: cannot be written ({exc.strerror}); nothing was changed.") from exc
        self.current = model._replace(mean=halved.mean.astype(np.float32), sd=halved.sd.astype(np.float32))
        self._failure = ""


def load_foreground(path: Path) -> Foreground:
    """Read what was learnt. Raises NodeError naming the file."""
    try:
        with open_archive(path) as file, np.load(file, allow_pickle=False) as read:
            if str(read["format"]) != str(_FORMAT):
                raise ValueError(f"its format is {str(read['format'])[:80]!r}")
            model = Foreground(*(np.ascontiguousarray(read[name], np.float32) for name in Foreground._fields))
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as exc:
        raise NodeError(f"{path}: what was learnt of background and skin cannot be read ({exc}). Learn it again, or "
                        "remove the file.") from exc
    colours = (BINS**3,)
    sound = (model.hand.shape == model.rest.shape == colours and model.mean.shape == model.sd.shape
             and model.mean.ndim == 3 and model.mean.shape[2] == 3
             and all(bool(np.isfinite(part).all()) and bool((part >= 0.0).all()) for part in model)
             and (not model.sd.size or float(model.sd.min()) > 0.0) and float(model.hand.min()) > 0.0)
    if not sound:
        raise NodeError(f"{path}: what was learnt of background and skin is not plausible. Learn it again, or remove "
                        "the file.")
    return model


def _skin_of(model: Foreground) -> str:
    """`none`, `generic` or `learnt`: what is known of the hand's colours."""
    if np.array_equal(model.hand, _FLAT.hand):
        return "none"
    return "generic" if np.array_equal(model.hand, _GENERIC.hand) else "learnt"
