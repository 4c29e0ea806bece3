"""What a wizard is made of, and what it is made from."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rhot_app.project import Rig
from rhot_app.ui.backend.contract import Asker, Listener
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.memory import Memory
from rhot_app.ui.wizards.page import Page


@dataclass(frozen=True, slots=True)
class Kit:
    """What every wizard is given: the rig in force, its file (None: it came from none), a way to ask the engine, the
    colours of the screen, and what was entered before. Node settings by node id are as the nodes gave them when the
    wizard was opened. `listen` makes a client that hears the hand's states, for wizards that calibrate by a moving
    hand."""

    rig: Rig
    rig_path: Path | None
    connect: Callable[[], Asker]
    scheme: Scheme
    memory: Memory
    node_settings: dict[int, dict[str, Any]] = field(default_factory=dict)
    listen: Callable[[], Listener] | None = None


@dataclass(frozen=True, slots=True)
class Plan:
    """A wizard ready to be shown: its pages in order, the last one an `AcceptPage`. `guide` is its page in the guide,
    where a section has the wizard's title;
    `solver` a module that the solving process should import in good time; `put_back` undoes in a worker what the wizard
    has tried out, when it is closed without being used."""

    title: str
    pages: tuple[Page, ...]
    guide: str = "calibration"
    solver: str = ""
    put_back: Callable[[], None] | None = None
