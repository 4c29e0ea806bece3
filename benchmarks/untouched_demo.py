"""The window on the simulated rig, tracking, untouched for half an hour: what it says, and what memory it takes.

    xvfb-run -a -s "-screen 0 1280x800x24" python benchmarks/untouched_demo.py [--minutes 30] [--pictures DIR]
        [--motion M] [--seed N] [--tracker T] [--json FILE]

It is `rhot demo` with its own engine, simulated nodes and settings. Its sentences are read twice a second; the memory
that window and engine keep resident, every ten seconds. `--pictures` keeps the screen at minute 3, at half time and at
the end. Exit code 1: a warning or an error was shown, or a process's memory left 5 % of what it was at minute 3.
"""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tables import publish, table

from rhot_app.engine.process import running_engine
from rhot_app.errors import EngineError
from rhot_app.ui import demo_command
from rhot_app.ui.app import choose_gl_platform

SETTLED_MIN, MOST_GROWTH = 3.0, 0.05
READ_S, MEMORY_S = 0.5, 10.0


@dataclass
class Said:
    """One sentence, whatever its numbers: when it was first and last read, s after the first state, how often, and its
    first and last words."""

    level: str
    first_s: float
    first: str
    last_s: float = 0.0
    last: str = ""
    count: int = 0


@dataclass
class Watch:
    """What was read: the sentences, how often each word at the top, MB resident at seconds after the first state."""

    sentences: dict[str, Said] = field(default_factory=dict)
    words: Counter[str] = field(default_factory=Counter)
    memory: list[dict[str, float]] = field(default_factory=list)

    def read(self, now_s: float, word: str, notices: list[tuple[str, str]]) -> None:
        """The word at the top and the (level, text) at the bottom."""
        self.words[word] += 1
        for level, text in notices:
            said = self.sentences.setdefault(re.sub(r"\d+(\.\d+)?", "#", text), Said(level, now_s, text))
            said.last_s, said.last, said.count = now_s, text, said.count + 1

    def growth(self, name: str) -> float:
        """By which share of what it was once the run had settled the memory of a process differs the most."""
        settled = [sample[name] for sample in self.memory if sample["s"] >= 60.0 * SETTLED_MIN]
        return max((abs(value / settled[0] - 1.0) for value in settled), default=float("nan"))


def resident_mb(pid: int | str) -> float:
    """SettingsStore of a process that is resident, NaN when there is none."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:
        return float("nan")
    return next((int(line.split()[1]) / 1024 for line in status.splitlines() if line.startswith("VmRSS")), float("nan"))


def watch_demo(args: argparse.Namespace, directory: Path) -> Watch:
    """Run the window to the end of its time. Raises EngineError when it never tracks or ends before."""
    choose_gl_platform()
    from PySide6.QtCore import QTimer

    from rhot_app.ui import main_window, status_words

    watch = Watch()
    end_s = 60.0 * args.minutes
    pictures = {60.0 * SETTLED_MIN, 0.5 * end_s, end_s}

    class WatchedWindow(main_window.MainWindow):
        """Reads itself."""

        def __init__(self, *parts: Any) -> None:
            super().__init__(*parts)
            self._begun_s: float | None = None
            self._next_memory_s = 0.0
            timer = QTimer(self, interval=round(1e3 * READ_S))
            timer.timeout.connect(self.read)
            timer.start()

        def read(self) -> None:
            """One reading."""
            if self._begun_s is None:
                self._begun_s = time.monotonic() if self.controller.live.state_count else None
                return
            now_s = time.monotonic() - self._begun_s
            watch.read(now_s, self.toolbar.badge.word,
                       [(notice.level, notice.text) for notice in
                        self.passing.among(status_words.notices_of(self.controller), self.controller.clock())])
            if now_s >= self._next_memory_s:
                self._next_memory_s += MEMORY_S
                engine = running_engine(directory)
                watch.memory.append({"s": now_s, "window": resident_mb("self"), "engine": resident_mb(engine or -1)})
            for due_s in [due_s for due_s in pictures if now_s >= due_s]:
                pictures.remove(due_s)
                if args.pictures is not None:
                    self.screen().grabWindow(self.winId()).save(str(args.pictures / f"minute-{due_s / 60.0:.0f}.png"))
            if now_s >= end_s:
                self.close()

    main_window.MainWindow = WatchedWindow  # type: ignore[misc]
    demo_command.run(args)
    if not watch.memory or watch.memory[-1]["s"] < end_s - 2.0 * MEMORY_S:
        raise EngineError("the window was closed, or tracked nothing, before the time was over.")
    return watch


def main() -> int:
    """Watch, print, judge."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--pictures", type=Path, metavar="DIR")
    parser.add_argument("--json", type=Path, metavar="FILE", help="also write all figures there")
    demo_command.add_arguments(parser)
    with tempfile.TemporaryDirectory(prefix="rhot-") as work:
        args = parser.parse_args()
        if args.pictures is not None:
            args.pictures.mkdir(parents=True, exist_ok=True)
        args.directory = args.directory or Path(work) / "engine"
        args.settings = args.settings or Path(work) / "settings.ini"
        watch = watch_demo(args, args.directory)
    growths = {name: watch.growth(name) for name in ("window", "engine")}
    marks = sorted({0.0, SETTLED_MIN, 0.5 * args.minutes, args.minutes})
    samples = [min(watch.memory, key=lambda sample, at=at: abs(sample["s"] - 60.0 * at)) for at in marks]
    sentences = sorted(watch.sentences.values(), key=lambda said: said.first_s)
    alarms = [said for said in sentences if said.level != "info"]
    total = sum(watch.words.values())
    publish(args, {"sentences": [vars(said) for said in sentences], "words": dict(watch.words),
                   "memory": watch.memory, "growth": growths},
            table(["minute", "window, MB", "engine, MB"],
                  [[f"{sample['s'] / 60.0:.1f}", sample["window"], sample["engine"]] for sample in samples]),
            f"Farthest from minute {SETTLED_MIN:g}: " +
            ", ".join(f"{name} {growth:.1%}" for name, growth in growths.items()) + ". The word at the top: " +
            ", ".join(f"{word} {count / total:.1%}" for word, count in watch.words.most_common()) + ".",
            table(["level", "from, s", "to, s", "read for, s", "sentence"],
                  [[said.level, said.first_s, said.last_s, READ_S * said.count, said.last] for said in sentences]))
    return int(bool(alarms) or not all(growth <= MOST_GROWTH for growth in growths.values()))


if __name__ == "__main__":
    sys.exit(main())
