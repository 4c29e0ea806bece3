"""The status of outputs that an engine publishes; apart, because clients load neither sinks nor the hand."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

SECRET_VARIABLE: Final = "RHOT_WEB_SECRET"
"""Environment variable in which the engine keeps the secret of all its web views, so that a page that is open finds
them again whenever its outputs are started anew."""

OutputWord = Literal["starting", "running", "failed", "stopped"]


@dataclass(frozen=True, slots=True)
class OutputStatus:
    """How an output goes. `spec`: as typed behind ``--output``. `sent` and `dropped` count states: a state that came
    too soon for the output's rate is neither. `clients` is None for an output that nobody connects to."""

    spec: str
    kind: str
    state: OutputWord
    message: str = ""  # why it failed, or is slow
    sent: int = 0
    dropped: int = 0
    clients: int | None = None
    url: str = ""
    fixed: bool = False  # of the command line: no other rig closes it
