"""The simulated rig's foreign tracker: prints its poses, one a line, as other trackers' programs do (docs/objects.md).

``python -m rhot_app.simulator.nodes.tracker DIR``, with the directory of a live twin. It ends when nobody reads.
"""

from __future__ import annotations

import contextlib
import os
import sys
import time
from pathlib import Path

from rhot_app.errors import SimulatorError
from rhot_app.simulator.nodes.remote import TwinRemote

NAME = "SIM-1"
_PERIOD_S = 1.0 / 120.0


def run(directory: Path) -> None:
    """Print poses until standard output is closed. Raises SimulatorError when the twin gives no answer."""
    with TwinRemote(directory) as twin:
        began_ns = since_ns = time.monotonic_ns()
        while True:
            for t_ns, numbers in twin.tracker(since_ns).poses:
                since_ns = t_ns
                print(f"{1e-9 * (t_ns - began_ns):.6f} {NAME} {' '.join(f'{number:.9g}' for number in numbers)}")
            sys.stdout.flush()
            time.sleep(_PERIOD_S)


def main() -> int:
    """The process; code 2 with a sentence without a twin."""
    if len(sys.argv) != 2:
        print("usage: python -m rhot_app.simulator.nodes.tracker DIR", file=sys.stderr)
        return 2
    with contextlib.suppress(KeyboardInterrupt):
        try:
            run(Path(sys.argv[1]))
        except SimulatorError as exc:
            print(exc, file=sys.stderr)
            return 2
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


if __name__ == "__main__":
    sys.exit(main())
