"""The protocol in a terminal: says what to do, has the running engine record it, and asks what a ruler says."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from rhot_app.certificate.certify import STEPS
from rhot_app.certificate.recordings import (
    PlumbStep,
    ProtocolFile,
    RodStep,
    RulerStep,
    StaticStep,
    write_protocol,
)
from rhot_app.engine.client import EngineClient
from rhot_app.errors import CertificateError
from rhot_app.project import Rig

SECONDS: dict[str, float] = {"static": 10.0, "ruler": 2.0, "rod": 20.0, "flash": 20.0, "plumb": 3.0}
"""How long each step is recorded; with the reading of a ruler about five minutes."""


def collect(folder: Path, rig: Rig, engine: EngineClient, ask: Callable[[str], str],
            wait: Callable[[float], None] = time.sleep, say: Callable[[str], None] = print) -> ProtocolFile:
    """Lead through the steps; each may be left out by an answer that begins with "s". Logs and ``protocol.json`` stand
    in `folder` afterwards. The patch on the screen needs the app, and is not done here.

    Raises EngineError when there is no engine or it refuses; what was recorded stays, with its protocol.
    """
    ids = rig.markers.ids
    protocol: dict[str, Any] = {}

    def record(step: str, name: str) -> str | None:
        if ask(f"{STEPS[step]} Enter records {SECONDS[step]:g} s, s leaves it out: ").strip().lower().startswith("s"):
            return None
        log = f"{name}.rhotlog"
        engine.command("record", path=str(folder / log))
        wait(SECONDS[step])
        engine.command("record_stop")
        say(f"recorded {log}")
        return log

    def marker(question: str, default: str) -> str:
        while True:
            name = ask(f"{question} ({', '.join(ids)}; Enter: {default}): ").strip() or default
            if name in ids:
                return name
            say(f"there is no marker {name!r}.")

    try:
        if not engine.command("hello").get("running", True):
            engine.command("start")
        log = record("static", "static")
        if log is not None:
            answer = ask("Which side of a hand faced the cameras? p: palm, b: back, Enter: it was no hand: ").lower()
            protocol["static"] = StaticStep(log, {"p": "palm", "b": "back"}.get(answer[:1]))  # type: ignore[arg-type]
        held = marker("Which marker do you hold along the ruler?", ids[0])
        ruler: list[RulerStep] = []
        while (distance := _number(ask, say, "Distance in mm by the ruler, Enter: no more: ")) is not None:
            log = record("ruler", f"ruler_{len(ruler) + 1:02d}_{distance:.0f}mm")
            if log is not None:
                ruler.append(RulerStep(log, distance, held))
                protocol["ruler"] = tuple(ruler)
        length = _number(ask, say, "Length of the rod in mm, from centre to centre of its markers, Enter: no rod: ")
        if length is not None:
            first = marker("Which marker is at one end?", ids[0])
            second = marker("And at the other, lower one when it hangs?", ids[1 % len(ids)])
            log = record("rod", "rod")
            if log is not None:
                protocol["rod"] = RodStep(log, length, (first, second))
            log = record("plumb", "plumb")
            if log is not None:
                protocol["plumb"] = PlumbStep(log, first, second)
        say("The flashing patch needs a window: open Calibrate, Certificate in the app for it.")
    finally:
        made = ProtocolFile(**protocol)
        write_protocol(folder, made)
    return made


def _number(ask: Callable[[str], str], say: Callable[[str], None], question: str) -> float | None:
    """A length in mm, None for an empty answer."""
    while True:
        answer = ask(question).strip().replace(",", ".")
        if not answer:
            return None
        try:
            value = float(answer)
        except ValueError:
            value = 0.0
        if 0.0 < value <= 10_000.0:
            return value
        say(f"{answer!r} is no length in mm between 0 and 10000.")


FORMS = {"static": "static[:palm|:back]=FILE", "ruler": "ruler:MM:MARKER=FILE", "rod": "rod:MM:UPPER,LOWER=FILE",
         "plumb": "plumb:UPPER,LOWER=FILE"}
"""How a raw log is given as one step, and what is said of it."""


def protocol_of_steps(steps: list[str]) -> ProtocolFile:
    """The protocol of ``--step`` options, written as in `FORMS`. Raises CertificateError."""
    fields: dict[str, Any] = {}
    ruler: list[RulerStep] = []
    for text in steps:
        words, _, file = text.partition("=")
        name, *said = words.split(":")
        if name not in STEPS or not file:
            raise CertificateError(f"--step {text}: write {', '.join(FORMS.values())}.")
        log = str(Path(file).absolute())
        if name == "flash":
            raise CertificateError(f"--step {text}: a flash needs the times of its screen, which protocol.json has. "
                                   "Use --recordings DIR with a folder of the app.")
        wrong = CertificateError(f"--step {text}: write {FORMS[name]}, {_SAID[name]}.")
        match name, said:
            case "static", []:
                fields["static"] = StaticStep(log)
            case "static", ["palm" | "back" as facing]:
                fields["static"] = StaticStep(log, facing)
            case "ruler", [length, marker] if marker:
                ruler.append(RulerStep(log, _length(length, wrong), marker))
            case "rod", [length, pair] if len(_pair(pair)) == 2:
                upper, lower = _pair(pair)
                fields["rod"] = RodStep(log, _length(length, wrong), (upper, lower))
            case "plumb", [pair] if len(_pair(pair)) == 2:
                fields["plumb"] = PlumbStep(log, *_pair(pair))
            case _:
                raise wrong
    return ProtocolFile(ruler=tuple(ruler), **fields)


def merged(protocol: ProtocolFile, given: ProtocolFile) -> ProtocolFile:
    """The protocol with the steps that are `given` in the place of its own."""
    steps = {name: step for name in ("static", "ruler", "rod", "plumb") if (step := getattr(given, name))}
    return msgspec.structs.replace(protocol, **steps)


_SAID = {"static": "with the side of the hand that faced the cameras, or nothing when it was no hand",
         "ruler": "with the distance by the ruler and the marker that was held, as ruler:300:index=FILE",
         "rod": "with its length and its markers, the upper one first, as rod:152:thumb,index=FILE",
         "plumb": "with the rod's markers, the upper one first"}


def _pair(text: str) -> list[str]:
    return [one for one in text.split(",") if one]


def _length(text: str, otherwise: CertificateError) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0.0 < value <= 10_000.0:
        raise otherwise
    return value
