"""Command lines as they were spelt before: read for one release, each with a note that says how it is spelt now.

docs/commands.md lists them for people. A row of `_OPTIONS` is an option that went; `{}` in what replaces it stands
for its value.
"""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterable, Sequence

from rhot_app.errors import SimulatorError

_SCENE = {
    "--background": "--set background={}", "--back": "--set facing=back", "--worn": "--set worn_paint={}",
    "--uneven": "--set uneven_paint={}", "--glove": "--set glove_rgb={}", "--lamp": "--set lamp.brightness={}",
    "--kelvin": "--set lamp.kelvin={}", "--mains": "--set lamp.mains_hz={}",
}
_OF_SHOW = {
    "board": {
        "--board": "--set show.size={}", "--square-mm": "--set show.square_mm={}",
        "--charuco": "--set show.pattern=charuco", "--marker-mm": "--set show.marker_mm={}",
        "--dictionary": "--set show.dictionary={}", "--legacy-pattern": "--set show.legacy=true",
        "--legacy": "--set show.legacy=true", "--on-table": "--set show.on_table=true"},
    "ruler": {"--ruler-mm": "--set show.length_mm={}"},
    "marker": {"--marker": "--set show.marker={}", "--moving": "--set show.moving=true"},
}
"""By what is shown: options that were ignored beside anything else."""

_SHOW = {
    "--cube": "--set show.cube=true", "--bare": "--show bare-hand", "--tone": "--set show.tone={}",
    "--sleeve": "--set show.sleeve=true", **_OF_SHOW["board"], **_OF_SHOW["ruler"], **_OF_SHOW["marker"],
}
_LENSES = {"--left-intrinsics": "--intrinsics left={}", "--right-intrinsics": "--intrinsics right={}"}
_OPTIONS: dict[str, dict[str, str]] = {
    "simulate": _SCENE | _SHOW,
    "calibrate stereo": _LENSES, "calibrate together": _LENSES,
    "evaluate live": _SCENE,
    "evaluate compare": _SCENE | {"--recording": "--motions {}"},
    "mouse run": {"--gain": "--set gain={}", "--height-gain": "--set height_gain={}",
                  "--height-from": "--set height_from={}", "--on-table": "--set on_table=true"},
}
"""By command: the options that went, and what says the same now."""

_BOARD = {"--kind": "{}", "--board": "{}", "--marker-mm": "marker_mm={}", "--tag-spacing": "tag_spacing={}",
          "--dictionary": "dictionary={}", "--legacy-pattern": "legacy", "--legacy": "legacy"}
"""The options that became the parts of `--board`, and the part that each is; the board of `target` has no option."""

_EVALUATE = {"--compare": "compare", "--bare-hand": "bare-hand"}
_MOUSE = {"--measure": "measure"}
_COMPARED = "rest,wave,grasp,pinch,fast"


def present_spelling(arguments: Sequence[str]) -> list[str]:
    """The same command line as it is spelt now; a note on standard error says what has changed."""
    said, ignored = _shown(list(arguments))
    present = _certified(_tracked(_board(_options_of(_with_subcommand(said)))))
    if present != list(arguments):
        left = f" Left out, because it says nothing of what is shown: {', '.join(ignored)}." if ignored else ""
        print(f"rhot: this is the former spelling, read for one release.{left} Now: rhot {shlex.join(present)}",
              file=sys.stderr)
    return present


def _shown(arguments: list[str]) -> tuple[list[str], list[str]]:
    """The arguments of `simulate` without the options that were ignored, and these. Raises SimulatorError."""
    if arguments[:1] != ["simulate"]:
        return arguments, []
    rest, shows = _taken(arguments, ["--show"])
    show = shows[-1][1] if shows else "hand"
    if "--bare" in arguments:
        if show not in ("hand", "bare-hand"):
            raise SimulatorError(f"--bare is of a hand: leave out --show {show}, or it.")
        arguments = rest
    elif not shows and _taken(arguments, ["--scene"])[1]:
        return arguments, []  # the file says what is shown
    other = {option: new for one, options in _OF_SHOW.items() if one != show for option, new in options.items()}
    kept, ignored = _taken(arguments, other, [option for option, new in other.items() if "{}" not in new])
    return kept, [option for option, _ in ignored]


def _with_subcommand(arguments: list[str]) -> list[str]:
    """`evaluate` and `mouse` were one command each, and options chose what they did."""
    if not arguments or arguments[0] not in ("evaluate", "mouse") or (
            {"-h", "--help"} & set(arguments[1:])) or (len(arguments) > 1 and not arguments[1].startswith("-")):
        return arguments
    name, *rest = arguments
    switches, usual = (_EVALUATE, "live") if name == "evaluate" else (_MOUSE, "run")
    chosen = next((word for option, word in switches.items() if option in rest), usual)
    kept = [word for word in rest if switches.get(word) != chosen]
    return [name, chosen, *kept]


def _options_of(arguments: list[str]) -> list[str]:
    """Every option that went, replaced; a value may follow it or stand behind an equals sign."""
    former = next((_OPTIONS[name] for count in (2, 1) if (name := " ".join(arguments[:count])) in _OPTIONS), {})
    found, words = [], iter(arguments)
    for word in words:
        option, equals, value = word.partition("=")
        new = former.get(option)
        if new is None:
            found.append(word)
        elif "{}" not in new:
            found += new.split()
        else:
            given = value if equals else next(words, None)
            if given is None:
                return arguments  # the parser says that its value is lacking
            if option == "--recording" and not any(one.split("=")[0] == "--motions" for one in arguments):
                found += ["--motions", _COMPARED]
            found += [part.replace("{}", given) for part in new.split()]
    return found


def _taken(arguments: list[str], options: Iterable[str], flags: Iterable[str] = ()) -> tuple[
        list[str], list[tuple[str, str]]]:
    """The arguments without some options, and these, in order, each with its value."""
    kept: list[str] = []
    found: list[tuple[str, str]] = []
    words = iter(arguments)
    for word in words:
        option, equals, value = word.partition("=")
        if option in flags:
            found.append((option, ""))
        elif option in options and (equals or (value := next(words, "\0")) != "\0"):
            found.append((option, value))
        else:
            kept.append(word)
    return kept, found


def _board(arguments: list[str]) -> list[str]:
    """What described a board, as the parts of one option."""
    command = tuple(arguments[:2])
    target = command[:1] == ("target",)
    if not target and command not in {("calibrate", name) for name in ("intrinsics", "lens", "stereo", "together")}:
        return arguments
    flags = [option for option, part in _BOARD.items() if "{}" not in part]
    kept, found = _taken(arguments, _BOARD, flags)
    if {option for option, _ in found} <= (set() if target else {"--board"}):
        return arguments
    found.sort(key=lambda one: list(_BOARD).index(one[0]))
    parts = [_BOARD[option].replace("{}", value) for option, value in found]
    if not target:
        return [*kept, "--board", ",".join(parts)]
    kind = next((k for k, word in enumerate(kept) if word in ("chessboard", "charuco", "aprilgrid", "circles")), None)
    return arguments if kind is None else [*kept[:kind], ",".join([kept[kind], *parts]), *kept[kind + 1:]]


def _tracked(arguments: list[str]) -> list[str]:
    """`bare-hand` was the name of `track`, whose videos were options."""
    if arguments[:1] not in (["track"], ["bare-hand"]):
        return arguments
    kept, found = _taken(arguments[1:], ["--video"])
    return ["track", *(video for _, video in found), *kept]


_CERTIFIED = ("--facing", "--marker", "--rod-mm", "--rod-markers")


def _certified(arguments: list[str]) -> list[str]:
    """What was said of all steps of `certify`, said of each."""
    if arguments[:1] != ["certify"]:
        return arguments
    kept, found = _taken(arguments, _CERTIFIED)
    if not found:
        return arguments
    said = dict(found)
    facing, marker, length, pair = (said.get(option, "") for option in _CERTIFIED)
    more = {"static": [facing], "ruler": [marker], "rod": [length, pair], "plumb": [pair]}

    def step(text: str) -> str:
        words, equals, file = text.partition("=")
        return ":".join([words, *filter(None, more.get(words.split(":")[0], []))]) + equals + file

    return [step(word) if kept[k - 1:k] == ["--step"] else f"--step={step(word[7:])}" if word.startswith("--step=")
            else word for k, word in enumerate(kept)]
