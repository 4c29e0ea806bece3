"""Renew the measured figures of docs/accuracy.md, and those of README.md which come from them.

    python benchmarks/accuracy_page.py [--only NAME ...] [--list] [--check]

A section's figures stand between `<!-- figures: NAME -->` and `<!-- end -->`; everything else on the page is written by
hand. A section is its command, run in the root of the repository, and what it prints on standard output: Markdown. Its
block is replaced as soon as the command has ended, so that an interrupted run leaves a whole page. A command that fails
or prints nothing leaves the old block: exit code 2. A missed aim (the command's exit code 1) is no failure.
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import subprocess
import sys
import textwrap
import time
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from tables import WIDTH

from rhot_node.files import write_atomically

ROOT = Path(__file__).resolve().parents[1]
PAGE, README = ROOT / "docs" / "accuracy.md", ROOT / "README.md"
README_BLOCK = "times"
MISSING = "?"  # of a figure that the page has not


@dataclass(frozen=True)
class Section:
    """The command as one types it, and how long it usually takes on two cores."""

    command: str
    minutes: float

    @property
    def script(self) -> Path:
        """The benchmark that the command runs."""
        return ROOT / next(word for word in shlex.split(self.command) if word.startswith("benchmarks/"))


SECTIONS = {
    "whole-path": Section("python benchmarks/accuracy.py", 20.0),
    "paints": Section("python benchmarks/paints.py", 20.0),
    "jitter": Section("python benchmarks/jitter.py", 1.0),
    "jitter-definitions": Section("python benchmarks/jitter_definitions.py", 0.5),
    "pairing": Section("python benchmarks/pairing.py", 2.0),
    "clock": Section("python benchmarks/clock.py --seeds 5", 0.5),
    "latency": Section("python benchmarks/latency.py", 0.5),
    "outputs": Section("python benchmarks/outputs.py", 4.0),
    "flood": Section("python benchmarks/flood.py", 0.5),
    "fuzz": Section("python benchmarks/fuzz.py", 10.0),
    "log-damage": Section("python benchmarks/log_damage.py", 3.0),
    "node-start": Section("python benchmarks/node_start.py --cold", 2.0),
    "kinematics": Section("python benchmarks/kinematics.py", 0.5),
    "scene": Section("xvfb-run -a python benchmarks/scene.py", 0.5),
    "detection": Section("python benchmarks/detection.py --processor", 1.0),
    "wire": Section("python benchmarks/wire.py", 0.2),
    "centroid": Section("python benchmarks/centroid.py", 2.0),
    "independent": Section("python benchmarks/independent_scenes.py", 10.0),
    "covariances": Section("python benchmarks/painted_hand.py --seconds 1.5", 8.0),
    "false-locks": Section("python benchmarks/false_locks.py", 20.0),
    "certificate": Section("python benchmarks/certificate_intervals.py --seeds 6", 3.0),
    "bare-hand": Section("python benchmarks/bare_hand.py --only matched --seeds 2 --frames 30", 3.0),
    "thesis-speeds": Section("python benchmarks/thesis_speeds.py --seeds 2", 20.0),
    "contour-offsets": Section("python benchmarks/contour_offsets.py", 3.0),
    "hand-adaptation": Section("python benchmarks/hand_adaptation.py", 15.0),
    "mouse": Section("python benchmarks/mouse.py", 30.0),
    "alignment": Section("python benchmarks/alignment.py", 1.0),
    "contact": Section("python benchmarks/contact.py", 0.2),
    "time": Section("python benchmarks/time_calibration.py", 1.5),
    "intrinsics": Section("python benchmarks/intrinsics_intervals.py", 4.0),
    "stereo": Section("python benchmarks/stereo_intervals.py", 8.0),
    "self-calibration": Section("python benchmarks/self_calibration.py --seeds 1 --still-seconds 180", 1.0),
    "colours": Section("python benchmarks/colours.py --seeds 6 --frames 4", 10.0),
    "bones": Section("python benchmarks/bones.py", 6.0),
}


def block(name: str) -> re.Pattern[str]:
    """Matches a marked block; group 1 is its content."""
    return re.compile(rf"(?<=<!-- figures: {re.escape(name)} -->\n)(.*?)(?=<!-- end -->)", re.DOTALL)


def names(page: str) -> list[str]:
    """The marked blocks of a page."""
    return re.findall(r"^<!-- figures: (.+) -->$", page, re.MULTILINE)


def write_block(path: Path, name: str, content: str) -> None:
    """Replace one block on the page as it is now; `content` is Markdown."""
    text, count = block(name).subn(lambda _: f"{content.strip()}\n", path.read_text())
    if count != 1:
        raise RuntimeError(f"has {count} blocks in {path}, not one")
    write_atomically(path, text.encode())


def measure(section: Section) -> str:
    """The new content of a block. Raises RuntimeError with a sentence when there are no figures."""
    begun, words = time.monotonic(), shlex.split(section.command)
    words = [sys.executable if word == "python" else word for word in words]
    done = subprocess.run(words, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False,
                          env=os.environ | {"PYTHONPATH": str(ROOT)})
    if done.returncode not in (0, 1) or not done.stdout.strip():
        raise RuntimeError(f"ended with code {done.returncode} and {len(done.stdout)} characters of figures")
    print(done.stdout, f"({(time.monotonic() - begun) / 60.0:.1f} minutes)", flush=True)
    head = (f"`{section.command}`, {datetime.now():%-d %B %Y}, {os.cpu_count()} cores of {processor()}, load "
            f"{os.getloadavg()[1]:.1f}:")
    return textwrap.fill(head, WIDTH, break_long_words=False, break_on_hyphens=False) + f"\n\n{done.stdout}"


def processor() -> str:
    """What the kernel calls the processor."""
    found = re.search(r"model name\s*:\s*(.+)", Path("/proc/cpuinfo").read_text())
    return found.group(1) if found else "an unknown processor"


def figure(page: str, name: str, row: str, column: int) -> str:
    """A cell of a block's table; the first column is 0. `row`: a part of its name."""
    found = block(name).search(page)
    rows = [line.strip("| ").split("|") for line in (found.group() if found else "").splitlines()]
    return next((cells[column].strip() for cells in rows if row in cells[0]), MISSING)


def readme_times() -> str:
    """README's block, from the page."""
    page = PAGE.read_text()
    detected = figure(page, "detection", "track, outlines fitted", 1).split()[0]
    return f"""| time | median |
|---|---|
| detecting six markers in a 640 x 480 image | {detected} µs |
| from a datagram in the kernel to a published state | {figure(page, "latency", "receive to state", 1)} ms |
"""


def faults() -> list[str]:
    """What does not agree between the page, the sections and the benchmarks, in sentences; runs nothing."""
    marked = names(PAGE.read_text())
    said = [f"{PAGE.name}: the block {name} has no command in accuracy_page.py." for name in marked
            if name not in SECTIONS]
    said += [f"accuracy_page.py: {name} has {marked.count(name)} blocks in {PAGE.name}, not one." for name in SECTIONS
             if marked.count(name) != 1]
    times = block(README_BLOCK).search(README.read_text())
    if times is None or times.group() != readme_times() or MISSING in times.group():
        said.append(f"{README.name}: the block {README_BLOCK} has not the figures of {PAGE.name}; renew detection.")
    for name, section in SECTIONS.items():
        if not section.script.exists():
            said.append(f"{name}: {section.script} does not exist.")
            continue
        source = section.script.read_text()
        said += [f"{name}: {section.script.name} has no option {word}." for word in shlex.split(section.command)
                 if word.startswith("--") and f'"{word}"' not in source]
    return said


def main() -> int:
    """Renew, list or check."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=list(SECTIONS), metavar="NAME",
                        help="sections to renew (default: all)")
    parser.add_argument("--list", action="store_true", help="print names, commands and usual minutes")
    parser.add_argument("--check", action="store_true", help="say which blocks and commands do not agree; run nothing")
    args = parser.parse_args()
    if args.list:
        for name in args.only:
            print(f"{name:20} {SECTIONS[name].minutes:5.1f} min  {SECTIONS[name].command}")
        return 0
    if args.check:
        said = faults()
        print("\n".join(said) or f"{len(SECTIONS)} blocks and their commands agree.")
        return 2 if said else 0
    failed = []
    for name in args.only:
        print(f"{name}: {SECTIONS[name].command}", flush=True)
        try:
            write_block(PAGE, name, measure(SECTIONS[name]))
            write_block(README, README_BLOCK, readme_times())
        except (RuntimeError, OSError) as exc:
            failed.append(f"{name}: the old figures stay, `{SECTIONS[name].command}` {exc}.")
        except KeyboardInterrupt:
            failed.append(f"{name}: interrupted; its figures and those of the sections after it stay.")
            break
    if failed:
        print("\n".join(failed), file=sys.stderr)
    return 2 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
