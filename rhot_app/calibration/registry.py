"""What a calibration is, and all of them in the order in which a new rig needs them.

The Calibrate menu, `rhot calibrate`, the wizards, a rig's history and its health read these records. The code has no
other list of calibrations. A record stands in a file of `rhot_app.calibration.kinds`, with the
functions that it names. Those files import what computes inside their functions, so that menus and help stay fast.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import argparse

    from rhot_app.calibration.report import Report
    from rhot_app.calibration.verdict import Finding
    from rhot_app.progress import Progress
    from rhot_app.project import Rig

KINDS = "rhot_app.calibration.kinds"
ORDER = ("camera", "lens", "stereo", "refined", "colours", "foreground", "adapted", "measured", "time", "depth",
         "bones", "filters", "alignment", "certificate")
"""In which a new rig needs them; others, of tests, follow by their names."""


@dataclass(frozen=True, slots=True)
class InForce:
    """What a calibration would change: the rig, its file (None: it came from none), and the settings of the nodes that
    answered, by id."""

    rig: Rig
    path: Path | None = None
    node_settings: Mapping[int, dict[str, Any]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Observed:
    """What a command has read: `observations` for ``solve``, and what is in force, None without a rig. `findings`,
    `notes` and `fields` (of JSON) join the report."""

    observations: tuple[Any, ...]
    now: InForce | None = None
    findings: tuple[Finding, ...] = ()
    notes: tuple[str, ...] = ()
    fields: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Command:
    """``rhot calibrate WORD``, also by the words `aliases`. `summary` goes on after "Calibrate".

    `observe` reads what the arguments name. `write` gives the files that it has written of a result that may be used;
    by default the proposed rig goes to ``--out``. `instead` may do something else, and gives its exit code then.
    """

    word: str
    summary: str
    add_arguments: Callable[[argparse.ArgumentParser], None]
    observe: Callable[[argparse.Namespace, Progress], Observed]
    aliases: tuple[str, ...] = ()
    write: Callable[[argparse.Namespace, Any, InForce | None], str] | None = None
    instead: Callable[[argparse.Namespace], int | None] | None = None


@dataclass(frozen=True, slots=True)
class Calibration:
    """One calibration.

    `title` is its wizard's, `meaning` what it finds and from what, a sentence. `reason` begins what it writes into a
    rig's history, so that menus can tell when it was used last.

    `collect` are the steps of its wizard (`rhot_app.calibration.collect`); without any, the module of that name in
    `rhot_app.ui.wizards` makes its pages. ``solve(*observations, now, progress=...)`` gives the result, or raises
    CalibrationError; it runs in another process, so it is a function of a module. `solver` is a module that this
    process should import in good time.

    ``report(result, now)`` says what was found, ``propose(result, now)`` gives a
    `proposal.Proposal` of what would change, None for nothing.
    ``check(figures)`` looks at a running rig's `check.health.HealthFigures` for what this calibration mends.
    """

    name: str
    title: str
    meaning: str
    reason: str
    command: Command | None = None
    collect: tuple[Any, ...] = ()
    solve: Callable[..., Any] | None = None
    report: Callable[..., Report] | None = None
    propose: Callable[..., Any] | None = None
    check: Callable[[Any], list[Finding]] = lambda figures: []
    solver: str = ""


@cache
def calibrations() -> tuple[Calibration, ...]:
    """All that stand in files of `KINDS`."""
    found = {}
    for module in pkgutil.iter_modules(importlib.import_module(KINDS).__path__):
        for one in vars(importlib.import_module(f"{KINDS}.{module.name}")).values():
            if isinstance(one, Calibration):
                found[one.name] = one
    order = {name: place for place, name in enumerate(ORDER)}
    return tuple(sorted(found.values(), key=lambda one: (order.get(one.name, len(order)), one.name)))


def calibration(name: str) -> Calibration:
    """The one of that name. Raises KeyError."""
    found = find_calibration(name)
    if found is None:
        raise KeyError(name)
    return found


def find_calibration(name: str) -> Calibration | None:
    """The one of that name, None without one."""
    return next((one for one in calibrations() if one.name == name), None)
