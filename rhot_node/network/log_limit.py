"""Log lines that somebody else causes: at most one a minute of each, so that nobody can fill a disk with them."""

from __future__ import annotations

from typing import Final

PERIOD_S: Final = 60.0
_SUBJECTS_MAX = 32  # told apart at a time; all further ones count as one


class LogLimit:
    """Counts what happens of each subject, and says when a line of it is due."""

    def __init__(self) -> None:
        self._written: dict[str, tuple[float, int]] = {}  # when the last line was written, and how often since

    def due(self, subject: str, now_s: float) -> int:
        """It happened: how often since the last line when one is due now, else 0. `now_s`: monotonic, s."""
        self._written = {name: entry for name, entry in self._written.items()
                         if now_s - entry[0] < PERIOD_S or entry[1]}
        if subject not in self._written and len(self._written) >= _SUBJECTS_MAX:
            subject = "others"
        written_s, since = self._written.get(subject, (now_s - PERIOD_S, 0))
        since += 1
        if now_s - written_s < PERIOD_S:
            self._written[subject] = written_s, since
            return 0
        self._written[subject] = now_s, 0
        return since
