"""Makes the summaries of recordings one after the other, in a process of its own, while the list is looked at."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, Signal

from rhot_app.ui.backend.solver import Solver, StoppedError
from rhot_app.ui.common.job import CancelledError, Job, Progress
from rhot_app.ui.language import tr
from rhot_app.ui.replay.library import Entry, Library, Summary, summarise_log


class Summaries(QObject):
    """`changed` gives the path of a recording of which more is known."""

    changed = Signal(object)

    def __init__(self, library: Library, solver: Solver, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._library = library
        self._solver = solver
        self._made: dict[Path, tuple[int, Summary]] = {}  # with the size of the file that each is of
        self._sizes: dict[Path, int] = {}
        self._words: dict[Path, str] = {}
        self._waiting: list[Path] = []
        self._job: Job | None = None
        self._closed = False

    def want(self, entries: list[Entry]) -> None:
        """These are looked at now, in this order; what was made of a file by another name or size is forgotten."""
        self._sizes = {entry.path: entry.size for entry in entries}
        self._made = {path: made for path, made in self._made.items() if self._sizes.get(path) == made[0]}
        self._words = {path: words for path, words in self._words.items() if path in self._sizes}
        self._waiting = [path for path in self._sizes if path not in self._made]
        self._next()

    def of(self, path: Path) -> Summary | None:
        """What is known of a recording; None while nothing is."""
        made = self._made.get(path)
        return None if made is None else made[1]

    def words(self, path: Path) -> str:
        """What stands in a summary's place: how far it is, or why there is none."""
        return self._words.get(path, tr("waiting …"))

    def close(self) -> None:
        """End the work and its process."""
        self._closed = True
        self._waiting = []
        if self._job is not None:
            self._job.cancel()
        self._solver.stop()

    def _next(self) -> None:
        if self._job is not None or not self._waiting or self._closed:
            return
        path = self._waiting.pop(0)
        self._job = Job(lambda progress: self._summarise(path, progress), lambda summary: self._take(path, summary),
                        lambda sentence: self._fail(path, sentence),
                        lambda text, fraction: self._say(path, f"{100 * fraction:.0f} %"), self).start()

    def _summarise(self, path: Path, progress: Progress) -> Summary:
        known = self._library.known_summary(path)
        if known is not None:
            return known
        try:
            made: Summary = self._solver.run(summarise_log, (path,), progress.report)
        except StoppedError as exc:
            raise CancelledError(tr("Cancelled.")) from exc
        self._library.keep_summary(path, made)
        return made

    def _take(self, path: Path, summary: Any) -> None:
        self._job = None
        self._made[path] = (self._sizes.get(path, -1), summary)
        self.changed.emit(path)
        self._next()

    def _fail(self, path: Path, sentence: str) -> None:
        self._job = None
        self._say(path, sentence)
        self._next()

    def _say(self, path: Path, words: str) -> None:
        self._words[path] = words
        self.changed.emit(path)
