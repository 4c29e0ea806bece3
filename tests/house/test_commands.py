"""Commands explain themselves, and the documents name only commands and options that exist."""

from __future__ import annotations

import contextlib
import importlib
import io
import json
import re
import shlex
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from rhot_app.__main__ import SUBCOMMANDS, parse
from rhot_app.__main__ import main as rhot
from rhot_app.calibration.commands.calibrate import FILES
from rhot_app.calibration.registry import calibrations
from rhot_node.__main__ import daemon_parser
from rhot_node.commands import COMMANDS, parser_of

ROOT = Path(__file__).parents[2]
CALIBRATING = tuple(one.command.word for one in calibrations() if one.command is not None)
MODULES = {"rhot": "rhot_app", "rhot-node": "rhot_node"}

OPTIONS: dict[str, tuple[str, ...]] = {
    "rhot": ("--version", "--cameras", "demo", "engine", "replay", "simulate", "evaluate"),
    "rhot demo": ("--motion", "--seed"),
    "rhot engine": ("--rig", "--record", "--video", "--output", "--web"),
    "rhot replay": ("LOG", "--rig", "--keep", "--smooth"),
    "rhot refine": ("LOG", "--rig", "--out", "--use", "--no-scale", "--json"),
    "rhot report": ("LOG", "--out", "--rig", "--directory"),
    "rhot video": ("collect", "LOG", "--rig", "--out", "--keep"),
    "rhot layers": ("FILE", "--angle", "--from", "--out", "--force", "--json"),
    "rhot fit-hand": ("--rig", "--pictures", "--at", "--hand", "--save", "--settings"),
    "rhot recover": ("LOG", "--out", "--rig"),
    "rhot landmarks": ("CSV", "--rig", "--out", "--fps", "--json", "install", "--wheel"),
    "rhot track": ("CAMERA=VIDEO", "--rig", "--observe", "--bones", "--smooth", "--fps", "--offset-s", "--out",
                   "--overlay", "--force", "--json"),
    "rhot offset": ("NAME=FILM", "--by", "--json"),
    "rhot export": ("LOG", "--out", "--format", "--rig", "--tracker", "--rate", "--frame", "--units", "--hand",
                    "--smooth", "--force"),
    "rhot trim": ("LOG", "--from", "--to", "--out", "--force"),
    "rhot batch": ("LOG", "--do", "--out", "--workers", "--scheduler", "--force", "--format", "--rig", "--tracker"),
    "rhot simulate": ("--motion", "--seconds", "--out", "--show", "--pictures", "--points", "--markers", "--scene",
                      "--set"),
    "rhot evaluate": ("live", "compare", "bare-hand"),
    "rhot evaluate live": ("--motion", "--seconds", "--seed", "--loss", "--preset", "--distance", "--json", "--scene",
                           "--set", "--detector", "--frames"),
    "rhot evaluate compare": ("--motions", "--seeds", "--trackers", "--sketched", "--logs", "--scene", "--set",
                              "--baseline"),
    "rhot evaluate bare-hand": ("--cases", "--seeds", "--seconds", "--logs", "--json"),
    "rhot calibrate alignment": ("--foreign", "--rig-points", "--search", "--out", "--check", "--json"),
    "rhot calibrate bones": ("--log", "--tsv", "--rig", "--roles", "--hand", "--side", "--set", "--name", "--out",
                             "--json"),
    "rhot calibrate colours": ("--image", "--sample", "--markers", "--skin", "--out", "--json"),
    "rhot calibrate filters": ("--log-still", "--log-fast", "--rig", "--out", "--per-marker", "--jitter-mm",
                               "--lag-ms", "--json"),
    "rhot calibrate time": ("--log", "--rig", "--out", "--json"),
    "rhot calibrate depth": ("--table", "--rig", "--out", "--baseline-mm", "--view-angle-deg", "--json"),
    "rhot calibrate import": ("FILE", "--format", "--unit", "--square-mm", "--size", "--camera", "--rig-from",
                              "--keep-world", "--out", "--intrinsics", "--json"),
    "rhot calibrate export": ("--rig", "--format", "--camera", "--unit", "--square-mm", "--out", "--force"),
    "rhot calibrate intrinsics": ("--images", "--board", "--square-mm", "charuco", "marker_mm", "dictionary",
                                  "legacy", "--square-pixels", "--out", "--rig", "--node", "--json"),
    "rhot target": ("chessboard", "marker_mm", "--square-mm", "dictionary", "legacy", "aprilgrid", "circles",
                    "--paper", "--out"),
    "rhot check": ("--rig", "--json"),
    "rhot history": ("--rig", "--restore", "--json"),
    "rhot certify": ("--rig", "--recordings", "--step", "static:palm", "ruler:MM", "rod:MM", "plumb:",
                     "--simulated", "--sketched", "--seed", "--keep", "--out", "--compare", "--json"),
    "rhot calibrate stereo": (
        "--left", "--right", "--camera", "--offset-s", "--board", "--square-mm", "marker_mm",
        "--intrinsics", "--refine-intrinsics", "--baseline-mm", "--ruler-mm",
        "--ruler", "--table-image", "--rig-from", "--out", "--json"),
    "rhot hand": ("HAND", "--length", "--proportions", "--side", "--name", "--rows", "--out", "--rig", "--draw",
                  "--json"),
    "rhot object": ("FILE", "--images", "--rig", "--json"),
    "rhot poses": ("--source", "--tracker", "--seconds", "--out", "--json", "openvr", "libsurvive"),
    "rhot mouse": ("run", "measure"),
    "rhot mouse run": ("--directory", "--simulated", "--log", "--rig", "--bare", "--cameras", "--seed", "--set",
                       "--osc", "--pointer", "--seconds", "--json"),
    "rhot mouse measure": ("--bare", "--cameras", "--seed", "--places", "--pictures", "--json"),
    "rhot nodes": ("--seconds", "--json"),
    "rhot cameras": ("--json",),
    "rhot pair": ("NODE", "--rig", "--port", "--code"),
    "rhot-node pair": ("--settings",),
    "rhot-node unpair": ("--settings",),
    "rhot-node": ("--settings", "--camera", "--loop", "--exit-with-parent", "--log-level", "/dev/video", "yuv:",
                  "stream:", "?rate=max", "detect", "doctor", "install"),
    "rhot-node doctor": ("--settings", "--json"),
    "rhot-node install": ("--node-id", "--name", "--settings", "--camera", "--user", "--dry-run"),
    "rhot-node uninstall": ("--user",),
    "rhot-node landmarks": ("install", "--wheel", "--service"),
    "rhot-node detect": ("--markers", "--detector", "--all", "--json"),
}


@cache
def help_of(command: str) -> str:
    """What ``COMMAND --help`` prints; it must end with code 0."""
    program, *arguments = command.split()
    main, told = importlib.import_module(f"{MODULES[program]}.__main__").main, io.StringIO()
    with contextlib.redirect_stdout(told), pytest.raises(SystemExit) as end:
        main([*arguments, "--help"])
    assert end.value.code == 0
    return told.getvalue()


@cache
def documented_commands() -> dict[str, list[str]]:
    """By command: the lines of the documents that run it, each after its file; ``./run X`` is read as ``rhot X``."""
    found: dict[str, list[str]] = {}
    for path in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        text = path.read_text().replace("\\\n", " ") if path.exists() else ""
        spans = re.findall(r"`((?:rhot|rhot-node|\./run) [^`\n]+)`", text)
        lines = re.findall(r"^\s*(?:\$ )?((?:\.venv/bin/)?(?:rhot|rhot-node|\./run) [^\n]+)$", text, re.MULTILINE)
        for line in [*spans, *lines]:
            line = line.split("#")[0].removeprefix(".venv/bin/").strip()
            if re.match(r"\./run (test|setup)\b|\S+ COMMAND", line):
                continue
            words = line.replace("./run ", "rhot ").split()
            command = next(named for count in (3, 2, 1) if (named := " ".join(words[:count])) in OPTIONS)
            found.setdefault(command, []).append(" ".join([f"{path.name}:", *words]))
    return found


@pytest.mark.parametrize("command", OPTIONS)
def test_help_names_every_option(command: str) -> None:
    text = help_of(command)
    missing = [option for option in OPTIONS[command] if option.lower() not in text.lower()]
    assert not missing, f"{command} --help does not mention {', '.join(missing)}"


def test_documented_commands_exist() -> None:
    none = [line for line in documented_commands()["rhot"] if re.search(": rhot [^-]", line)]
    assert not none, f"there are no such commands: {none}"


@pytest.mark.parametrize("command", OPTIONS)
def test_documented_options_exist(command: str) -> None:
    unknown = {option: line for line in documented_commands().get(command, [])
               for option in re.findall(r"(?<!\S)--?[a-z][a-z-]*", line) if option not in help_of(command)}
    assert not unknown, f"{command} --help does not name {unknown}"


@pytest.mark.parametrize("module", MODULES.values())
def test_a_program_starts_as_a_module(module: str) -> None:
    done = subprocess.run([sys.executable, "-m", module, "--help"], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "usage: " in done.stdout, done.stderr


EVERY_COMMAND = ("rhot", *(f"rhot {name}" for name in SUBCOMMANDS),
                 *(f"rhot calibrate {kind}" for kind in (*CALIBRATING, *FILES)),
                 *(f"rhot evaluate {name}" for name in ("live", "compare", "bare-hand")),
                 *(f"rhot mouse {name}" for name in ("run", "measure")),
                 "rhot-node", *(f"rhot-node {name}" for name in COMMANDS))


def examples_of(command: str) -> list[list[str]]:
    """The words of the examples at the end of a command's help."""
    return [shlex.split(line.strip().removeprefix("sudo "))
            for line in help_of(command).partition("\nexamples:\n")[2].splitlines()]


@pytest.mark.parametrize("command", EVERY_COMMAND)
def test_help_ends_with_two_examples_that_are_valid(command: str, tmp_path: Path,
                                                    monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    examples = examples_of(command)
    assert len(examples) == 2 and examples[0] != examples[1]
    for words in examples:
        program, *arguments = words
        for word in arguments:
            if "." in word and "*" not in word and "/" not in word:
                Path(word.partition("=")[2] or word).touch()
        assert words[:len(command.split())] == command.split() or command in (
            "rhot calibrate", "rhot evaluate", "rhot mouse")
        if program == "rhot":
            parse(arguments)
        elif arguments[0] in COMMANDS:
            parser_of(arguments[0])[1].parse_args(arguments[1:])
        else:
            daemon_parser().parse_args(arguments)


@pytest.mark.parametrize(("word", "kind"), [(alias, one.command.word) for one in calibrations() if one.command
                                            for alias in one.command.aliases])
def test_a_calibration_has_one_name_and_its_former_ones_still_run_it(
        word: str, kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Each refuses to begin without its input."""
    told = []
    for name in (word, kind):
        with contextlib.suppress(SystemExit):
            assert rhot(["calibrate", name]) == 2
        told.append(capsys.readouterr().err.replace(f"calibrate {name}", f"calibrate {kind}"))
    assert told[0] == told[1] != ""


def test_wizards_and_commands_call_a_calibration_by_one_name() -> None:
    """Every kind of `rhot calibrate` is a word of its wizard's title, and no former title is left in the documents."""
    titles = " ".join(wizard.title.lower() for wizard in calibrations())
    assert [word for word in CALIBRATING if word not in titles] == []
    told = " ".join(path.read_text() for path in (ROOT / "docs").rglob("*.md"))
    assert not re.findall(r"put the cameras together|find the lens", told, re.IGNORECASE)


def test_a_file_that_exists_is_only_replaced_by_force(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The option has one name in all commands that have it; a bare hand's and a batch's have their own tests."""
    with_force = {name for name in SUBCOMMANDS if "--force" in help_of(f"rhot {name}")}
    assert with_force == {"report", "layers", "export", "poses", "track", "trim", "batch"}
    log, mine = tmp_path / "a.rhotlog", {name: tmp_path / f"mine.{name}" for name in ("zip", "png", "csv")}
    for path in (log, *mine.values()):
        path.write_text("mine")
    for arguments in (["report", "--out", str(mine["zip"])], ["layers", "--out", str(mine["png"])],
                      ["export", str(log), "--out", str(mine["csv"])],
                      ["poses", "--source", "udp:1", "--out", str(mine["csv"])]):
        assert rhot(arguments) == 2 and "--force" in capsys.readouterr().err
    assert {path.read_text() for path in mine.values()} == {"mine"}


SIGNS = re.compile(r"\+/?-(?![\]\w])")


def test_plus_or_minus_is_one_sign() -> None:
    """±, on the screen, in what commands print, and in the documents."""
    pages = [path for folder in ("rhot_app", "rhot_node", "docs") for ending in ("*.py", "*.md", "*.html", "*.js")
             for path in (ROOT / folder).rglob(ending)] + [ROOT / "README.md", ROOT / "CHANGELOG.md"]
    found = [f"{path.relative_to(ROOT)}:{number}" for path in pages
             for number, line in enumerate(path.read_text().splitlines(), 1) if SIGNS.search(line)]
    assert not found


def test_the_list_of_commands_is_whole() -> None:
    """docs/README.md has a row for every command."""
    rows = re.findall(r"^\| `rhot ([a-z-]+)", (ROOT / "docs" / "README.md").read_text(), re.MULTILINE)
    assert not SUBCOMMANDS.keys() - set(rows)


NO_SUCH_FILE = (
    "replay NONE --json", "export NONE --format csv", "refine NONE", "recover NONE --out x", "video collect NONE",
    "bare-hand --rig NONE --video left=a.mp4", "bare-hand --rig RIG --video left=NONE",
    "landmarks NONE --rig RIG --out x", "calibrate bones --log NONE", "calibrate time --log NONE --rig RIG",
    "calibrate filters --log-still NONE --log-fast NONE --rig RIG",
    "calibrate colours --image x.png --markers NONE --out x",
    "calibrate depth --table NONE", "calibrate alignment --foreign NONE --rig-points NONE", "hand NONE", "object NONE",
    "offset NONE NONE", "calibrate import NONE", "calibrate export --rig NONE --format ros --out x",
    "layers NONE --out x.png", "fit-hand --rig NONE --pictures a b", "check --rig NONE", "engine --rig NONE",
    "certify --rig NONE", "report NONE --out x.zip", "--rig NONE",
)


REFUSALS = """
import contextlib, io, json, sys, rhot_app
sys.modules["numba"] = None  # whatever imports it fails
from rhot_app.__main__ import main
told = {}
for command in json.loads(sys.argv[1]):
    with contextlib.redirect_stderr(io.StringIO()) as error:
        code = main(command.replace("NONE", "no-such-file").replace("RIG", sys.argv[2]).split())
    told[command] = code, error.getvalue()
print(json.dumps(told))
"""


@pytest.fixture(scope="module")
def refusals(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[int, str]]:
    """By command: its exit code and what it says, in a program without compiled code."""
    done = subprocess.run([sys.executable, "-c", REFUSALS, json.dumps(NO_SUCH_FILE),
                           str(ROOT / "resources" / "rigs" / "two_pis.json")], capture_output=True, text=True,
                          check=False, cwd=tmp_path_factory.mktemp("here"))
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("command", NO_SUCH_FILE)
def test_a_missing_file_is_refused_before_compiled_code_is_loaded(
        command: str, refusals: dict[str, tuple[int, str]]) -> None:
    """Loading it takes seconds, and the first time of all minutes."""
    code, told = refusals[command]
    assert code == 2 and "no-such-file" in told, told


def test_help_loads_no_numerical_library() -> None:
    """Help is at once, and `announce_compilation` comes before numba."""
    code = ("import importlib, sys\n"
            "from rhot_app.__main__ import SUBCOMMANDS\n"
            "for each in SUBCOMMANDS.values():\n"
            "    importlib.import_module(each.module)\n"
            "sys.exit(', '.join({'cv2', 'numba', 'scipy'} & set(sys.modules)) or None)")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, f"loaded by command modules: {done.stderr}"
