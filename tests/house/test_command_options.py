"""How many options the commands have; the counts only fall."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
OFFERED_MOST = 326
DEFINED_MOST = 190


def test_commands_get_no_more_options(tmp_path: Path) -> None:
    """`python benchmarks/command_options.py --each` lists them. One that is new makes room first: in the rig file, the
    scene file, or by one that nobody needs."""
    kept = tmp_path / "counts.json"
    subprocess.run([sys.executable, str(ROOT / "benchmarks" / "command_options.py"), "--json", str(kept)], check=True,
                   capture_output=True)
    counts = json.loads(kept.read_text())
    assert counts["options offered"] <= OFFERED_MOST and counts["options defined"] <= DEFINED_MOST, counts
    assert len(counts["by command"]) > 40 and "--json" in counts["by command"]["rhot evaluate live"]
