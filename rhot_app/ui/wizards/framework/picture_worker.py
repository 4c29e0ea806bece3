"""The thread that has a step look at the newest pictures. No Qt."""

from __future__ import annotations

import logging
import threading
from typing import Any

from rhot_app.ui.backend.feed import LiveFeed, Picture
from rhot_app.ui.backend.reader import Reader
from rhot_app.ui.wizards.framework.step import Step

log = logging.getLogger(__name__)

_IDLE_S = 0.01


class PictureWorker(Reader):
    """Looks for one step at a time; `found` gives each finding once. Every look has a new picture of every camera: who
    judges whether something moved must not see the same picture twice."""

    def __init__(self, feed: LiveFeed) -> None:
        super().__init__()
        self._feed = feed
        self._lock = threading.Lock()
        self._step: Step | None = None
        self._found: tuple[Step, Any] | None = None
        self._looked_at: dict[str, Picture] = {}

    def watch(self, step: Step | None) -> None:
        """Look for `step` from now on; None rests. What was found for another step is forgotten."""
        with self._lock:
            self._step = step if step is not None and step.watches else None
            self._found = None
            self._looked_at = {}

    def found(self, step: Step) -> Any:
        """What was found for `step` since the last call; None for nothing new."""
        with self._lock:
            found, self._found = self._found, None
        return found[1] if found is not None and found[0] is step else None

    def look(self) -> bool:
        """One look, if there is anything new to see; whether there was."""
        with self._lock:
            step, last = self._step, self._looked_at
        if step is None:
            return False
        pictures = self._feed.together(step.cameras or self._feed.cameras)
        if not pictures or any(picture is last.get(name) for name, picture in pictures.items()):
            return False
        try:
            seen = step.observe(pictures)
        except Exception:  # one strange picture must not end the live view; the log has the whole story
            log.exception("a picture could not be looked at")
            seen = None
        with self._lock:
            if self._step is step:
                self._looked_at = pictures
                self._found = (step, seen) if seen is not None else self._found
        return True

    def _run(self) -> None:
        while not self._ending.is_set():
            if not self.look():
                self._ending.wait(_IDLE_S)
