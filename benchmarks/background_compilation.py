"""Latency from kernel to state while the app compiles the rest of the numerical code, and afterwards.

Start the app on a computer that has compiled the window's part only, then this at once. It attaches to the app's
engine, waits until everything is compiled, and goes on for as long again (at most --seconds). Exit code 1: the 99th
percentile while it compiles is more than 1.5 times that afterwards.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from tables import arguments, publish, table

from rhot_app.api import live
from rhot_node.compiled import ALL, is_complete

MOST_RATIO = 1.5


def main() -> int:
    parser = arguments(__doc__)
    parser.add_argument("--directory", type=Path, metavar="DIR", help="the engine's private directory")
    parser.add_argument("--seconds", type=float, default=90.0, metavar="S", help="longest time afterwards (default 90)")
    args = parser.parse_args()
    if is_complete(ALL):
        print("Everything is compiled already. Start this right after the first start of the app.", file=sys.stderr)
        return 2
    begun_s = time.monotonic()
    done_s = None
    values: tuple[list[float], list[float]] = ([], [])
    for state in live(args.directory, patience_s=600.0):
        if done_s is None and is_complete(ALL):
            done_s = time.monotonic()
        if "receive_to_state" in state.latency_s:
            values[done_s is not None].append(1e3 * state.latency_s["receive_to_state"])
        if done_s is not None and time.monotonic() - done_s > min(args.seconds, done_s - begun_s):
            break
    assert done_s is not None
    rows = [(name, len(found), float(np.median(found)), float(np.percentile(found, 99)), max(found))
            for name, found in zip(("while it compiles", "afterwards"), values, strict=True)]
    ratio = rows[0][3] / rows[1][3]
    publish(args, {"compiled_s": done_s - begun_s, "rows": rows, "ratio": ratio},
            table(("kernel to state", "states", "p50 ms", "p99 ms", "max ms"), rows),
            f"Everything was compiled {done_s - begun_s:.0f} s after this began. p99 while it compiles is {ratio:.2f} "
            f"times that afterwards (aim: at most {MOST_RATIO:g}).")
    return int(ratio > MOST_RATIO)


if __name__ == "__main__":
    sys.exit(main())
