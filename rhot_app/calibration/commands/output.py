"""What every calibration command prints: one JSON object, or the verdict in words."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from rhot_app.calibration.verdict import Verdict


def add_json_argument(parser: argparse.ArgumentParser) -> None:
    """``--json``, the same everywhere."""
    parser.add_argument("--json", action="store_true", help="print one JSON object on standard output")


def require_folder(out: Path | None) -> None:
    """Raise CalibrationError unless a file can be written there: before the work, not after."""
    from rhot_app.errors import CalibrationError
    from rhot_node.files import require_replaceable

    if out is not None and not out.parent.is_dir():
        raise CalibrationError(f"{out}: there is no folder {out.parent}. Make it first, or name another place.")
    if out is not None:
        try:
            require_replaceable(out)
        except OSError as exc:
            raise CalibrationError(f"{out}: cannot be written ({exc.strerror}).") from exc


def tell(fields: dict[str, Any], lines: list[str], verdict: Verdict, *, as_json: bool) -> None:
    """Print a result and its verdict: one JSON object, or sentences and `lines` for people."""
    if as_json:
        print(json.dumps({**fields, **verdict.to_json()}))
        return
    print(verdict.sentence)
    for finding in verdict.findings:
        print(f"  [{finding.grade.value}] {finding.sentence}")
    print(*lines, sep="\n")


def show(fields: dict[str, Any], lines: list[str], verdict: Verdict, *, as_json: bool, written: str = "") -> int:
    """Print a calibration's result and return the exit code: 0, or 2 when the verdict forbids its use.

    `fields` are the JSON's, the verdict's own are added; `lines` the figures for people; `written` the file that was
    written, empty for none.
    """
    tell({**fields, "written": written or None}, lines, verdict, as_json=as_json)
    if written and not as_json:
        print(f"Written: {written}")
    if verdict.acceptable:
        return 0
    worst = verdict.findings[0].sentence
    print(f"rhot: nothing was written, because the result must not be used. {worst}", file=sys.stderr)
    return 2
