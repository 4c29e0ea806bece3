"""How a node starts and what it takes: seconds until "ready", memory, foreign packages, compiling anew.

    python benchmarks/node_start.py [--starts 5] [--cold] [--json FILE]
"""

from __future__ import annotations

import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import tables

from rhot_node.capture.yuv import YuvWriter
from rhot_node.config import CameraSettings, NodeSettings, save_settings
from rhot_node.detectors import warm_up_image
from rhot_node.files import resource_path
from rhot_node.markers import load_markers

SIZE = (640, 480)
FPS = 40
FRAMES = 200
TRACKED_S = 3.0  # of tracking before memory is read
READY_MAX_S, MEMORY_MAX_MB = 2.0, 250.0
NOT_WANTED = ("scipy", "PySide6", "OpenGL", "pyqtgraph", "rhot_app")
# The node as its command runs it; at its end it tells what it has imported.
NODE = """import json, sys
from rhot_node.__main__ import main
code = main()
print(json.dumps(sorted({name.split(".")[0] for name, module in sys.modules.items() if module is not None})))
sys.exit(code)"""


@dataclass(frozen=True)
class Start:
    """One start: s until ready and of the processor for it, resident and peak memory in MB after some tracking, and
    what was imported although the node needs it not."""

    ready_s: float
    processor_s: float
    memory_mb: float
    peak_mb: float
    unwanted: tuple[str, ...]


def make_node(folder: Path) -> list[str]:
    """Settings and a recording of six discs in `folder`; returns the node's arguments."""
    markers = load_markers(resource_path("markers", "rhot6.json"))
    image = warm_up_image(markers, SIZE)
    frame = np.concatenate([image.y.ravel(), image.u.ravel(), image.v.ravel()])
    with YuvWriter(folder / "frames", *SIZE, 4_000_000, 20_000) as writer:
        for k in range(FRAMES):
            writer.append(k * round(1e9 / FPS), frame)
    save_settings(folder / "node.json", NodeSettings(
        1, "left", markers, udp_port=0, control_port=0, preview_port=0, pairing_port=0,
        broadcast_port=None, camera=CameraSettings(width=SIZE[0], height=SIZE[1], fps=FPS)))
    return ["--settings", str(folder / "node.json"), "--camera", f"yuv:{folder / 'frames'}", "--loop"]


def start_node(arguments: list[str], environment: dict[str, str]) -> Start:
    """Start a node, let it track for a while, end it."""
    begun = time.monotonic()
    node = subprocess.Popen([sys.executable, "-c", NODE, *arguments], env=environment, stdout=subprocess.PIPE,
                            stderr=subprocess.PIPE, text=True)
    with node:
        assert node.stdout is not None
        line = node.stdout.readline()
        ready_s = time.monotonic() - begun
        if not line:
            raise SystemExit(f"the node did not get ready: {node.communicate()[1][-2000:]}")
        ticks = Path(f"/proc/{node.pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]
        time.sleep(TRACKED_S)
        status = Path(f"/proc/{node.pid}/status").read_text()
        node.send_signal(signal.SIGTERM)
        imported = json.loads(node.communicate()[0])
    return Start(ready_s, sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK"), _megabytes(status, "VmRSS"),
                 _megabytes(status, "VmHWM"), tuple(name for name in NOT_WANTED if name in imported))


def _megabytes(status: str, name: str) -> float:
    return next(float(line.split()[1]) for line in status.splitlines() if line.startswith(f"{name}:")) / 1024


def main() -> int:
    """Start a node several times, print a table; 1 when a warm start misses what is promised."""
    parser = tables.arguments(__doc__)
    parser.add_argument("--starts", type=int, default=5, help="warm starts")
    parser.add_argument("--cold", action="store_true", help="first compile anew, in a cache of its own (minutes)")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="rhot-") as work:
        arguments = make_node(Path(work))
        environment = dict(os.environ)
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        if args.cold:
            environment["NUMBA_CACHE_DIR"] = str(Path(work) / "numba")
        first = start_node(arguments, environment)
        warm = [start_node(arguments, environment) for _ in range(args.starts)]
    rows = []
    for name, starts in (("first, compiling" if args.cold else "first", [first]), (f"warm, of {args.starts}", warm)):
        ready, processor_s = ([getattr(start, key) for start in starts] for key in ("ready_s", "processor_s"))
        rows.append([name, statistics.median(ready), max(ready), statistics.median(processor_s),
                     *(f"{max(getattr(start, key) for start in starts):.0f}" for key in ("memory_mb", "peak_mb"))])
    ready_s, peak_mb = statistics.median(start.ready_s for start in warm), max(start.peak_mb for start in warm)
    unwanted = sorted({name for start in warm for name in start.unwanted})
    tables.publish(
        args, {"first": asdict(first), "warm": [asdict(start) for start in warm]},
        tables.table(["start", "ready after, s", "worst", "of the processor, s", "memory, MB", "peak, MB"],
                     [*rows, ["aim, warm", READY_MAX_S, None, None, None, f"{MEMORY_MAX_MB:.0f}"]]),
        f"Imported although the node does not need it: {', '.join(unwanted) or 'nothing'}.")
    return int(ready_s > READY_MAX_S or peak_mb > MEMORY_MAX_MB or bool(unwanted))


if __name__ == "__main__":
    sys.exit(main())
