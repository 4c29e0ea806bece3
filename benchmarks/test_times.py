"""How long the last run of the tests took, by room, and its slowest 50 tests. --keep renews the order of the next runs.

Wall-clock and processor time in seconds; a test's include those of the processes that it has started and ended.
"""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from pathlib import Path

from tables import arguments, publish, table

ROOT = Path(__file__).parents[1]
KEPT = ROOT / ".pytest_cache" / "v" / "rhot" / "test_times"
WEIGHTS = ROOT / "tests" / "file_seconds.json"
SLOWEST = 50
ALL_PARTS = 99

Times = dict[str, tuple[float, float]]


def summed(times: Times, parts: int) -> list[tuple[str, int, float, float]]:
    """(name, tests, wall-clock s, processor s) by the first `parts` of a test's path, longest first."""
    rows: dict[str, list[float]] = defaultdict(lambda: [0, 0.0, 0.0])
    for name, (wall_s, cpu_s) in times.items():
        row = rows["/".join(name.partition("::")[0].split("/")[:parts])]
        row[0] += 1
        row[1] += wall_s
        row[2] += cpu_s
    return sorted(((name, int(count), wall_s, cpu_s) for name, (count, wall_s, cpu_s) in rows.items()),
                  key=lambda row: -row[2])


def main() -> int:
    parser = arguments(__doc__)
    parser.add_argument("--keep", action="store_true", help=f"write the seconds of each file to {WEIGHTS.name}")
    args = parser.parse_args()
    if not KEPT.exists():
        print(f"The times of the last run of the tests are missing ({KEPT}). Run ./run test first.", file=sys.stderr)
        return 2
    times: Times = {name: (wall_s, cpu_s) for name, (wall_s, cpu_s) in json.loads(KEPT.read_text()).items()}
    if args.keep:
        weights = {name: round(wall_s, 1) for name, _, wall_s, _ in summed(times, ALL_PARTS)}
        WEIGHTS.write_text(json.dumps(dict(sorted(weights.items())), indent=0) + "\n")
    rooms = summed(times, 2)
    total = ("all", len(times), sum(row[2] for row in rooms), sum(row[3] for row in rooms))
    slowest = sorted(((name, *seconds) for name, seconds in times.items()), key=lambda row: -row[1])[:SLOWEST]
    publish(args, times, table(("room", "tests", "clock s", "processor s"), [*rooms, total]),
            table(("test", "clock s", "processor s"), slowest))
    return 0


if __name__ == "__main__":
    sys.exit(main())
