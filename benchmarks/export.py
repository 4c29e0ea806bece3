"""What an export costs: times real time and memory, by format and tracker; and what a second worker saves a batch.

The batch is run by rhot's own workers, and by those of a Dask cluster on this machine (extra [cluster]).

    python benchmarks/export.py [--seconds 600] [--formats csv,c3d] [--trackers classic] [--batch 8] [--json F]

The log is a sketched grasp of two cameras, 40 frames/s each (kept in ~/.cache/rhot/takes; sketching it takes a third
of its length). Every export is a process of its own: start, replay, tracking and writing. `x` is the log's length by
the time of the clock, `x cpu` by that of the processor, which other programs on the machine do not lengthen.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from distributed import LocalCluster
from tables import arguments, publish, table

from rhot_app.evaluation.data_sets import LOG_NAME, Order, data_set, data_sets_folder
from rhot_app.export.formats import all_formats
from rhot_app.simulator.scene.scene import make_scene, twin_defaults

GOALS = {"classic": 20.0, "estimator": 5.0}
GOAL_MB = 500.0


_CHILD = """
import resource, sys
from pathlib import Path
from rhot_app.__main__ import main
if __name__ == "__main__":
    code = main(sys.argv[1:])
    peak = next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    usage = resource.getrusage(resource.RUSAGE_SELF)
    print("figures", code, usage.ru_utime + usage.ru_stime, int(peak.split()[1]) / 1024)
"""


def measured(command: list[str]) -> tuple[float, float, float]:
    """Wall time s, processor time s and peak memory MB of a command in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "child.py"  # a file: workers that are spawned import it
        script.write_text(_CHILD)
        begun = time.monotonic()
        done = subprocess.run([sys.executable, str(script), *command], capture_output=True, text=True, check=False)
        wall_s = time.monotonic() - begun
    figures = done.stdout.splitlines()[-1].split() if done.stdout else []
    if figures[:2] != ["figures", "0"]:
        raise SystemExit(f"rhot {' '.join(command)} failed: {done.stderr}")
    return wall_s, float(figures[2]), float(figures[3])


def exports(log: Path, seconds: float, trackers: list[str], formats: list[str]) -> list[dict[str, Any]]:
    """One row per tracker and format."""
    rows = []
    for tracker in trackers:
        for name in formats:
            with tempfile.TemporaryDirectory() as folder:
                out = Path(folder) / f"a{all_formats()[name].endings[0]}"
                wall_s, cpu_s, peak_mb = measured(["export", str(log), "--out", str(out), "--tracker", tracker])
                row = {"tracker": tracker, "format": name, "wall_s": wall_s, "times_real_time": seconds / wall_s,
                       "times_real_time_cpu": seconds / cpu_s, "peak_mb": peak_mb,
                       "file_mb": out.stat().st_size / 1e6}
            rows.append(row)
    return rows


def batches(log: Path, count: int) -> dict[str, float]:
    """The same logs with one worker and with two, by rhot's own workers and by a Dask cluster's."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        logs = [Path(folder) / f"log{number}.rhotlog" for number in range(count)]
        for path in logs:
            shutil.copy(log, path)

        def batch(out: str, *options: str) -> float:
            return measured(["batch", *map(str, logs), "--do", "export", "--format", "npz", "--tracker", "classic",
                             "--out", str(Path(folder) / out), *options])[0]

        for workers in (1, 2):
            found[f"workers_{workers}_s"] = batch(f"own{workers}", "--workers", str(workers))
            with LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster:
                found[f"dask_{workers}_s"] = batch(f"dask{workers}", "--scheduler", cluster.scheduler_address)
    for kind in ("workers", "dask"):
        found[f"{kind}_gain"] = found[f"{kind}_1_s"] / found[f"{kind}_2_s"]
    return found


def main() -> int:
    """Run, print, write the JSON."""
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--formats", default=",".join(all_formats()), help="which formats; none: the batch alone")
    parser.add_argument("--trackers", default="classic,estimator")
    parser.add_argument("--batch", type=int, default=8, metavar="N", help="logs in the batch, 0: no batch (default 8)")
    parser.add_argument("--logs", type=Path, default=None, help="where logs are kept (default ~/.cache/rhot/takes)")
    args = parser.parse_args()
    order = Order(make_scene(twin_defaults(), 1), "grasp", args.seconds, sketched=True)
    log = data_set(order, args.logs or data_sets_folder()).folder / LOG_NAME
    found: dict[str, Any] = {"seconds": args.seconds}
    printed = []
    if args.formats != "none":
        rows = found["exports"] = exports(log, args.seconds, args.trackers.split(","), args.formats.split(","))
        printed.append(table(["tracker", "format", "s", "x real time", "x, processor", "MB", "file, MB"],
                             [list(row.values()) for row in rows]))
        goals = ", ".join(f"{goal:g} times real time ({tracker})" for tracker, goal in GOALS.items())
        printed.append(f"Goals: {goals}; below {GOAL_MB:g} MB.")
    if args.batch:
        batch = found["batch"] = batches(log, args.batch)
        printed.append(table([f"{args.batch} logs", "1 worker, s", "2 workers, s", "times as fast (goal 1.7)"],
                             [[name, *(batch[f"{kind}_{end}"] for end in ("1_s", "2_s", "gain"))]
                              for kind, name in (("workers", "own workers"), ("dask", "Dask cluster"))]))
    publish(args, found, *printed)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
