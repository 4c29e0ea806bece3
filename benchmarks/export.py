"""What an export costs: times real time and memory, by format and tracker; and what a second worker saves a batch.

The batch is run by rhot's own workers, and by those of a Dask cluster on this machine (extra [cluster]).

    python benchmarks/export.py [--seconds 600] [--formats csv,c3d] [--trackers classic] [--batch 8] [--json F]

The log is a sketched grasp of two cameras, 40 frames/s each (kept in ~/.cache/rhot/takes; sketching it takes a third
of its length). Every export is a process of its own: start, replay, tracking and writing. `x` is the log's length by
the time of the clock, `x cpu` by that of the processor, which other programs on the machine do not lengthen.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from distributed import LocalCluster

from rhot_app.evaluation.data_sets import LOG_NAME, Order, data_set, data_sets_folder
from rhot_app.export.export import FORMATS
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
    print(f"{seconds:g} s of two cameras\n{'tracker':8} {'format':8} {'s':>7} {'x':>6} {'x cpu':>6} {'MB':>5} "
          f"{'file MB':>8}")
    for tracker in trackers:
        for name in formats:
            with tempfile.TemporaryDirectory() as folder:
                out = Path(folder) / f"a{FORMATS[name].endings[0]}"
                wall_s, cpu_s, peak_mb = measured(["export", str(log), "--out", str(out), "--tracker", tracker])
                row = {"tracker": tracker, "format": name, "wall_s": wall_s, "times_real_time": seconds / wall_s,
                       "times_real_time_cpu": seconds / cpu_s, "peak_mb": peak_mb,
                       "file_mb": out.stat().st_size / 1e6}
            rows.append(row)
            print(f"{tracker:8} {name:8} {wall_s:7.1f} {row['times_real_time']:6.1f} {row['times_real_time_cpu']:6.1f} "
                  f"{peak_mb:5.0f} {row['file_mb']:8.1f}", flush=True)
    for tracker in trackers:
        slowest = min(row["times_real_time"] for row in rows if row["tracker"] == tracker)
        print(f"{tracker}: slowest format {slowest:.1f} times real time (goal {GOALS.get(tracker, 0.0):g})")
    print(f"most memory: {max(row['peak_mb'] for row in rows):.0f} MB (goal below {GOAL_MB:g})")
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
    for kind, name in (("workers", "own workers"), ("dask", "Dask cluster")):
        one_s, two_s = found[f"{kind}_1_s"], found[f"{kind}_2_s"]
        found[f"{kind}_gain"] = one_s / two_s
        print(f"{count} logs, {name}: 1 worker {one_s:.1f} s, 2 workers {two_s:.1f} s, {one_s / two_s:.2f} times as "
              f"fast (goal 1.7)")
    return found


def main() -> int:
    """Run, print, write the JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=600.0)
    parser.add_argument("--formats", default=",".join(FORMATS), help="which formats; none: the batch alone")
    parser.add_argument("--trackers", default="classic,estimator")
    parser.add_argument("--batch", type=int, default=8, metavar="N", help="logs in the batch, 0: no batch (default 8)")
    parser.add_argument("--logs", type=Path, default=None, help="where logs are kept (default ~/.cache/rhot/takes)")
    parser.add_argument("--json", type=Path, metavar="FILE")
    options = parser.parse_args()
    folder = options.logs or data_sets_folder()
    order = Order(make_scene(twin_defaults(), 1), "grasp", options.seconds, sketched=True)
    log = data_set(order, folder).folder / LOG_NAME
    found: dict[str, Any] = {"seconds": options.seconds}
    if options.formats != "none":
        found["exports"] = exports(log, options.seconds, options.trackers.split(","), options.formats.split(","))
    if options.batch:
        found["batch"] = batches(log, options.batch)
    if options.json:
        options.json.write_text(json.dumps(found, indent=1))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
