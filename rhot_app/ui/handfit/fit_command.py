"""``rhot fit-hand``: the window in which a hand is fitted to picture files, without engine and nodes."""

from __future__ import annotations

import argparse
import os
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.errors import CalibrationError, input_file, not_negative
from rhot_app.options import add_rig_argument, add_settings_argument
from rhot_node.terminal import add_examples

if TYPE_CHECKING:
    from rhot_app.hand.anatomy import HandAnatomy


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot fit-hand``."""
    add_rig_argument(parser, "the calibrated rig", required=True)
    parser.add_argument("--pictures", nargs="+", action="append", required=True, metavar="[NAME=]FILE",
                        help="pictures or videos of one instant, in the order of the rig's cameras or with their "
                             "names; give it again for another instant")
    parser.add_argument("--at", type=not_negative, nargs="+", default=[], metavar="S",
                        help="of videos: the second of each instant, from the first moment that all videos show "
                             "(default 0)")
    parser.add_argument("--hand", type=input_file, metavar="HAND",
                        help="hand file to begin with (default: the rig's hand)")
    parser.add_argument("--save", type=Path, metavar="OUT", help="where Save writes the hand file (default: asked for)")
    add_settings_argument(parser, "settings")
    add_examples(parser, "rhot fit-hand --rig desk.json --pictures left.png right.png --save mine.json",
                 "rhot fit-hand --rig desk.json --pictures left=left.mp4 right=right.mp4 --at 1.5 3")


def run(args: argparse.Namespace) -> int:
    """Open the window, and return when it is closed. Raises CalibrationError and RigError before it opens."""
    from rhot_app.hand.anatomy import load_hand
    from rhot_app.handfit.session import HandFit, warm_up
    from rhot_app.project import load_rig
    from rhot_app.rig_history import accept, require_hand_place
    from rhot_app.ui.handfit.files import read_instant
    from rhot_node.compiled import announce_compilation

    rig = load_rig(args.rig)
    hand = None if args.hand is None else load_hand(args.hand)
    if args.save is not None:
        require_hand_place(args.save)
    fit = HandFit(rig, hand)
    if len(args.at) > len(args.pictures):
        raise CalibrationError(f"--at names {len(args.at)} seconds, and --pictures was given {len(args.pictures)} "
                               "times; give a second for each.")
    for k, given in enumerate(args.pictures):
        fit.add_pictures(read_instant(rig, given, args.at[k] if k < len(args.at) else 0.0))
    fit.begin()
    _require_screen()
    announce_compilation()
    warm_up(rig)
    from PySide6.QtWidgets import QApplication

    from rhot_app.ui.app import choose_gl_platform, leave
    from rhot_app.ui.common.settings import Settings
    from rhot_app.ui.common.theme import apply_theme, scheme_named
    from rhot_app.ui.handfit.frame import Kept
    from rhot_app.ui.handfit.window import REASON, HandFitWindow
    from rhot_app.ui.language import use_language

    def use(found: HandAnatomy) -> None:
        """The hand into the rig file, which keeps what it had; whatever else stands there now stays."""
        import msgspec

        accept(args.rig, msgspec.structs.replace(load_rig(args.rig), hand=found), REASON)

    choose_gl_platform()
    settings = Settings(args.settings)
    app = QApplication.instance() or QApplication(sys.argv[:1])
    assert isinstance(app, QApplication)
    app.setApplicationName("RHOT")
    use_language(settings.language)
    scheme = scheme_named(settings.scheme)
    apply_theme(app, scheme)
    window = HandFitWindow(fit, scheme, settings, Kept(use, args.save))
    window.finished.connect(app.quit)
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: app.quit())  # heard between two turns of the window's timer
    window.show()
    app.exec()
    settings.sync()
    return leave(0)


def _require_screen() -> None:
    """Raises CalibrationError where no window can open: Qt would end the process."""
    if sys.platform.startswith("linux") and not any(os.environ.get(name) for name in (
            "DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM")):
        raise CalibrationError("There is no screen here on which a window could open. The rig and the pictures are in "
                               "order; run the command where there is one. `rhot track` needs no screen.")
