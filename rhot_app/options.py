"""Options that several commands have: one spelling, one meaning, defined once. Types of numbers are in `errors`."""

from __future__ import annotations

import argparse
from pathlib import Path

from rhot_app.errors import count, input_file, positive_number


def add_json_argument(parser: argparse._ActionsContainer,
                      what: str = "print one JSON object on standard output") -> None:
    """``--json``, the same everywhere."""
    parser.add_argument("--json", action="store_true", help=what)


def add_rig_argument(parser: argparse._ActionsContainer, what: str = "the rig file", *, required: bool = False,
                     exists: bool = True) -> None:
    """``--rig FILE``. `exists`: a file that is lacking is refused before anything is loaded."""
    parser.add_argument("--rig", type=input_file if exists else Path, required=required, metavar="FILE", help=what)


def add_out_argument(parser: argparse._ActionsContainer, what: str, *, required: bool = False,
                     metavar: str = "FILE") -> None:
    """``--out FILE``, or another place."""
    parser.add_argument("--out", type=Path, required=required, metavar=metavar, help=what)


def add_seed_argument(parser: argparse._ActionsContainer, what: str, default: int | None = 1) -> None:
    """``--seed N``. A default of None: the scene file's, else 1."""
    parser.add_argument("--seed", type=count, default=default, metavar="N", help=f"seed of {what} (default 1)")


def add_scene_argument(parser: argparse._ActionsContainer) -> None:
    """``--scene FILE``, of what is simulated."""
    parser.add_argument("--scene", type=Path, metavar="FILE",
                        help="a scene file, or the shot.json of a recording; what is given beside it wins over it")


def add_seconds_argument(parser: argparse._ActionsContainer, what: str, default: float | None) -> None:
    """``--seconds S``; `what` may name the default, a number's is named for it."""
    parser.add_argument("--seconds", type=positive_number, default=default, metavar="S",
                        help=what if default is None else f"{what} (default {default:g})")


def add_offset_argument(parser: argparse._ActionsContainer, what: str) -> None:
    """``--offset-s NAME=S``, of films."""
    parser.add_argument("--offset-s", action="append", default=[], metavar="NAME=S", help=f"seconds to add to {what}")


def add_tracker_argument(parser: argparse._ActionsContainer, what: str, default: str | None = None) -> None:
    """``--tracker``: what makes a hand of the observations."""
    parser.add_argument("--tracker", choices=("classic", "estimator"), default=default, help=what)


def add_settings_argument(parser: argparse._ActionsContainer, what: str) -> None:
    """``--settings FILE`` of a window."""
    parser.add_argument("--settings", type=Path, metavar="FILE",
                        help=f"remember {what} in this file instead of the user's configuration folder")


def add_force_argument(parser: argparse._ActionsContainer, what: str = "write over a file that exists") -> None:
    """``--force``; scripts from before it may say ``--again``."""
    parser.add_argument("--force", action="store_true", help=what)
    parser.add_argument("--again", action="store_true", dest="force", help=argparse.SUPPRESS)


def add_directory_argument(parser: argparse._ActionsContainer,
                           what: str = "private directory of the engine's sockets") -> None:
    """``--directory DIR`` of an engine that is not the user's one."""
    parser.add_argument("--directory", type=Path, metavar="DIR", help=what)
