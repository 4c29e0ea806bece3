"""What every command prints as JSON and the text files that it writes, kept and compared: a redesign keeps them.

    python benchmarks/recorded_reports.py keep FOLDER       # before it
    python benchmarks/recorded_reports.py compare FOLDER    # after it

The commands of `COMMANDS` run one after the other in one scratch folder, so that a later one reads what an earlier one
wrote. Of each the exit code, standard output, the sentence of a refusal, and the files that it wrote are kept; `keep`
writes `reports.json` into FOLDER. Inputs are simulated with fixed seeds, or those of ../shared/data and ../shared/cases
where these are there. `compare` prints a row for each value that is lacking, new or different: numbers by more than
1e-9 of themselves. Times, durations and versions are left out by name (`LEFT_OUT`). Exit code 1: there is such a row.
`--only WORD` takes the commands that have this word, and all simulations; what they read must be of these.

Left out are: `rhot evaluate live`, `certify` on a rig, `mouse measure` and `mouse run --simulated`, which take minutes
or depend on the machine's time; `engine`, `pair` and `video`, which need a live rig. Of `cameras`, `rhot-node doctor`
and the latency of `certify` the keys alone are compared, because the values say what this machine has.
"""

from __future__ import annotations

import contextlib
import io
import json
import math
import os
import re
import shlex
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from scipy.spatial.transform import Rotation
from tables import arguments, publish, table

from rhot_app.__main__ import main as rhot
from rhot_node.__main__ import main as rhot_node
from rhot_node.files import resource_path

SAME = 1e-9
SHARED = Path(__file__).resolve().parents[2] / "shared"
RESOURCES = resource_path("hands", "right.json").parents[1]
LEFT_OUT = {"elapsed_s", "replaced_at", "version", "created", "date", "computed_per_s", "step_p50_ms", "step_p99_ms"}
"""Keys whose values differ from run to run."""

VARY = {"cameras": re.compile(""), "rhot-node doctor": re.compile(""),
        "certify --simulated": re.compile(r"lines\[[24]\]|\.html")}
"""By the beginning of a command: places whose values say what this machine has, or how quick it is. Their keys are
compared."""

STAMP = re.compile(r"\d{4}-?\d\d-?\d\d[T-]\d\d:?\d\d:?\d\d[.\d]*(\+00:00|Z)?(-\d+)?")
NEVER = re.compile(r"(?!)")
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.]*\w)")
TEXTS = {".csv", ".trc", ".json", ".yaml", ".yml", ".toml", ".svg", ".bvh", ".html"}
LARGEST_TEXT = 2_000_000  # bytes of a file that is kept

COMMANDS = Path(__file__).with_suffix(".txt")
"""Command lines as a shell reads them, without `rhot`; {data}, {cases} and {resources} are folders."""


# -- inputs that no command makes --------------------------------------------------------------------------------------

def write_inputs() -> None:
    """A second tracker's poses beside a fingertip's positions, films with a flash, and two rigs."""
    t = np.arange(0.0, 20.0, 0.01)
    places = np.stack([0.1 * np.sin(1.3 * t) + 0.03 * np.sin(4.1 * t), 0.08 * np.cos(1.9 * t),
                       0.5 + 0.06 * np.sin(2.7 * t)], axis=1)
    turns = Rotation.from_rotvec(np.stack([0.7 * np.sin(0.9 * t), 0.6 * np.sin(1.7 * t), 0.5 * np.cos(1.1 * t)], 1))
    x, y, z, w = turns.as_quat().T
    poses = np.column_stack([t, places + np.array([1.0, -0.5, 0.2]), w, x, y, z])
    noise = np.random.default_rng(1).normal(0.0, 2e-4, places.shape)
    seen = np.column_stack([t + 0.12, places + turns.apply((0.01, 0.02, 0.05)) + noise])
    np.savetxt("foreign.csv", poses, fmt="%.9f", delimiter=",", header="t,x,y,z,qw,qx,qy,qz", comments="")
    np.savetxt("points.csv", seen, fmt="%.9f", delimiter=",", header="t,x,y,z", comments="")
    for name, flash in (("early.avi", 40), ("late.avi", 25)):
        film = cv2.VideoWriter(name, cv2.VideoWriter.fourcc(*"MJPG"), 30.0, (64, 48))
        for k in range(120):
            film.write(np.full((48, 64, 3), 200 if k >= flash else 40, np.uint8))
        film.release()
    rig = json.loads(resource_path("rigs", "two_pis.json").read_text())
    rig["nodes"][1]["pose"]["rotation_wxyz"] = [0.0, 0.0, 1.0, 0.0]
    Path("twisted.json").write_text(json.dumps(rig))
    motion = SHARED / "data" / "hand_motion" / "qualisys_hand_30s.tsv"
    if motion.exists():
        rows = motion.read_text().splitlines(keepends=True)[:700]
        Path("short.tsv").write_text("".join(rows).replace("NO_OF_FRAMES\t6000", "NO_OF_FRAMES\t688"))
    folder, text = SHARED / "data" / "bare_hand_stereo", ""
    for c in range(2 if folder.exists() else 0):  # the recorded bare hand, as anipose writes its cameras
        fx, _, cx, _, fy, cy, *_, k1, k2, p1, p2, k3 = numbers(folder / f"c{c}.dat")
        place = numbers(folder / f"rot_trans_c{c}.dat")
        turn, shift = cv2.Rodrigues(np.reshape(place[:9], (3, 3)))[0].ravel().tolist(), place[9:]
        text += (f"[cam_{c}]\nname = \"c{c}\"\nsize = [720, 720]\nmatrix = [[{fx}, 0.0, {cx}], [0.0, {fy}, {cy}], "
                 f"[0.0, 0.0, 1.0]]\ndistortions = [{k1}, {k2}, {p1}, {p2}, {k3}]\nrotation = {turn}\n"
                 f"translation = {shift}\n\n")
    Path("films.toml").write_text(text)


def numbers(path: Path) -> list[float]:
    """All numbers of a file, up to a comment."""
    return [float(word) for word in path.read_text().partition("#")[0].split() if not word[-1].isalpha()
            and not word.endswith(":")]


# -- running -----------------------------------------------------------------------------------------------------------

def run(line: str) -> dict[str, Any]:
    """What a command does: exit code, output, refusal, and the text files that are new or changed."""
    words = shlex.split(line.format(data=SHARED / "data", cases=SHARED / "cases", resources=RESOURCES))
    program, words = (rhot_node, words[1:]) if words[0] == "rhot-node" else (rhot, words)
    before, out, err = stamps(), io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = program(words)
        except SystemExit as end:  # of argparse
            code = end.code
        except Exception as error:
            code = f"{type(error).__name__}: {error}"
    files = {cleaned(str(path)): content(path) for path, stamp in stamps().items() if before.get(path) != stamp}
    sentences = [row for row in err.getvalue().splitlines() if row.startswith("rhot")] if code else []
    return {"code": code, "output": parsed(out.getvalue()), "refusal": [cleaned(row) for row in sentences[-1:]],
            "files": files}


def stamps() -> dict[Path, tuple[int, int]]:
    """Every file of the scratch folder, pictures aside, with what tells that it was written."""
    return {path: (path.stat().st_mtime_ns, path.stat().st_size) for path in sorted(Path().rglob("*"))
            if path.is_file() and path.suffix not in (".png", ".jpg", ".yuv")}


def content(path: Path) -> Any:
    """What is kept of a file."""
    if path.suffix not in TEXTS or path.stat().st_size > LARGEST_TEXT:
        return "not kept"
    return parsed(path.read_text())


def parsed(text: str) -> Any:
    """JSON of a text, or of its lines, without what differs from run to run; else its lines."""
    for rows in ([text], text.splitlines()):
        with contextlib.suppress(json.JSONDecodeError):
            found = [kept(json.loads(row)) for row in rows]
            return found[0] if len(found) == 1 else found
    return [cleaned(row) for row in text.splitlines()]


def kept(value: Any) -> Any:
    """A value of JSON without what differs from run to run."""
    if isinstance(value, dict):
        return {key: "left out" if key in LEFT_OUT else kept(each) for key, each in value.items()}
    if isinstance(value, list):
        return [kept(each) for each in value]
    return cleaned(value) if isinstance(value, str) else value


def cleaned(text: str) -> str:
    """A text with relative paths and without times."""
    for folder, name in ((Path.cwd(), "."), (SHARED, "SHARED"), (RESOURCES.parent, "RHOT")):
        text = text.replace(str(folder), name)
    return STAMP.sub("TIME", text)


# -- comparing ---------------------------------------------------------------------------------------------------------

def differences(then: Any, now: Any, vary: re.Pattern[str], place: str = "") -> Iterator[list[str]]:
    """Place, former and present value, of all that is not the same; values at places that match `vary` may differ."""
    if isinstance(then, dict) and isinstance(now, dict):
        for key in {**then, **now}:
            inside = f"{place}.{key}".strip(".")
            if key not in then or key not in now:
                yield [inside, short(then.get(key, "lacking")), short(now.get(key, "lacking"))]
            else:
                yield from differences(then[key], now[key], vary, inside)
    elif isinstance(then, list) and isinstance(now, list) and len(then) == len(now):
        for k, (one, other) in enumerate(zip(then, now, strict=True)):
            yield from differences(one, other, vary, f"{place}[{k}]")
    elif not vary.search(place) and not same(then, now):
        yield [place, short(then), short(now)]


def same(then: Any, now: Any) -> bool:
    """Whether two values are, numbers in texts as well."""
    if isinstance(then, str) and isinstance(now, str):
        return NUMBER.split(then) == NUMBER.split(now) and all(
            close(float(one), float(other))
            for one, other in zip(NUMBER.findall(then), NUMBER.findall(now), strict=True))
    if isinstance(then, (int, float)) and isinstance(now, (int, float)):
        return isinstance(then, bool) == isinstance(now, bool) and close(then, now)
    return bool(then == now)


def close(one: float, other: float) -> bool:
    """Whether numbers are the same, two that are no number as well."""
    return math.isclose(one, other, rel_tol=SAME, abs_tol=1e-12) or (math.isnan(one) and math.isnan(other))


def short(value: Any) -> str:
    """A value that fits into a cell."""
    text = value if isinstance(value, str) else json.dumps(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def main() -> int:
    """Keep, or compare and print the table."""
    parser = arguments(__doc__)
    parser.add_argument("what", choices=("keep", "compare"))
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default="", metavar="WORD", help="these commands, and all simulations")
    args = parser.parse_args()
    store = args.folder.resolve() / "reports.json"
    chosen = [line for line in COMMANDS.read_text().splitlines()
              if (line and args.only in line) or line.startswith("simulate")]
    then = json.loads(store.read_text()) if args.what == "compare" else {}
    found: dict[str, Any] = {}
    scratch = Path(tempfile.mkdtemp(prefix="recorded-reports-"))
    with contextlib.chdir(scratch):
        write_inputs()
        for number, line in enumerate(chosen, 1):
            folders = [SHARED / word.split("/")[0].strip("{}") / word.split("/")[1]
                       for word in re.findall(r"\{(?:data|cases)\}/\w+", line)]
            if not all(folder.exists() for folder in folders):
                print(f"not there: {line}", file=sys.stderr)
                continue
            began = time.perf_counter()
            found[line] = run(line)
            took = time.perf_counter() - began
            print(f"{number}/{len(chosen)} {took:5.1f} s, code {found[line]['code']}: {line[:90]}", file=sys.stderr,
                  flush=True)
    shutil.rmtree(scratch)
    if args.what == "keep":
        store.parent.mkdir(parents=True, exist_ok=True)
        store.write_text(json.dumps(found, indent=1) + "\n")
        publish(args, found, f"{len(found)} commands kept in {store}.")
        return 0
    rows = []
    for line, report in found.items():
        if line in then:
            vary = next((VARY[name] for name in VARY if line.startswith(name)), NEVER)
            rows += [[line[:60], *row] for row in differences(then[line], report, vary)]
    rows += [[line[:60], "command", "lacking", "new"] for line in found if line not in then]
    head = ["command", "place", "then", "now"]
    publish(args, rows, table(head, rows) if rows else f"{len(found)} commands: the same.")
    return 1 if rows else 0


if __name__ == "__main__":
    os.environ.setdefault("COLUMNS", "120")
    sys.exit(main())
