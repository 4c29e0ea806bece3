"""The process in which long work of the app runs, started with `python -m`, a niceness and a language. No
Qt but for the translations of a language other than English.

It reads pickled messages from standard input: a module's name to import in good time, or (function, arguments,
options) to run.
For work it writes pickled answers to standard output: ("progress", text, fraction), at last ("done", result) or
("failed", sentence). It ends with its input; whoever wants the work to stop ends the process.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import pickle
import sys
import time
from typing import Any, BinaryIO

from rhot_app.errors import RhotError
from rhot_node.errors import NodeError

NICENESS = 10
"""Below the window and the engine, which come first; a busy computer still lets the work go on."""

_REPORT_S = 0.05


def serve(source: BinaryIO, sink: BinaryIO) -> None:
    """Answer messages until `source` ends."""
    while True:
        try:
            message = pickle.load(source)
        except EOFError:
            return
        if isinstance(message, str):
            with contextlib.suppress(ImportError):
                importlib.import_module(message)
        else:
            _send(sink, _work(message, sink))


def _work(message: tuple[Any, tuple[Any, ...], dict[str, Any]], sink: BinaryIO) -> tuple[str, Any]:
    function, arguments, options = message
    reported_s = -1.0

    def progress(text: str, fraction: float) -> None:
        nonlocal reported_s
        now = time.monotonic()
        if now - reported_s >= _REPORT_S or fraction >= 1.0:
            reported_s = now
            _send(sink, ("progress", text, fraction))

    try:
        return "done", function(*arguments, progress=progress, **options)
    except (RhotError, NodeError, OSError) as exc:
        return "failed", str(exc)
    except Exception as exc:  # the sentence is for the screen; the trace goes where the app's own go
        import traceback

        from rhot_app.ui.language import tr

        traceback.print_exc()
        return "failed", tr("The program made a mistake ({name}: {exc}). Please report it.", name=type(exc).__name__,
                            exc=exc)


def _send(sink: BinaryIO, answer: tuple[Any, ...]) -> None:
    sink.write(pickle.dumps(answer, pickle.HIGHEST_PROTOCOL))
    sink.flush()


def main() -> None:
    """Keep standard output to the answers, and out of the way of everything else."""
    sink = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever a library prints must not end up among the answers
    if sys.argv[2:] not in ([], ["en"]):
        from rhot_app.ui.language import use_language

        use_language(sys.argv[2])
    with contextlib.suppress(OSError, AttributeError):
        os.nice((int(sys.argv[1]) if len(sys.argv) > 1 else NICENESS) - os.nice(0))
    with contextlib.suppress(BrokenPipeError, KeyboardInterrupt):
        serve(sys.stdin.buffer, sink)


if __name__ == "__main__":
    main()
