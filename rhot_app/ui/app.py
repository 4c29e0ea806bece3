"""``rhot``: the app. It finds or starts the engine, shows what it does, and ends what it started."""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import logging
import os
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from rhot_app.engine.compilation import BackgroundCompilation
from rhot_app.engine.directory import default_directory
from rhot_app.errors import EngineError, SourceError
from rhot_app.options import add_directory_argument, add_rig_argument, add_settings_argument
from rhot_app.project import load_rig
from rhot_app.ui.backend.contract import TwinChoice
from rhot_node.files import require_replaceable
from rhot_node.terminal import add_examples, log_to_stderr

if TYPE_CHECKING:
    from rhot_app.ui.common.controller import Controller

log = logging.getLogger(__name__)

LEAVE_S = 15.0
"""How long the end of the app waits for work that it has cancelled: a question to a node takes ten at most."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of ``rhot`` without a command."""
    add_rig_argument(parser, "open this rig file at once; with --cameras, take the cameras' lenses and places from it",
                     exists=False)
    parser.add_argument("--cameras", nargs="*", metavar="SOURCE",
                        help="open cameras of this computer: numbers that `rhot cameras` lists, films, folders of "
                             "pictures, or addresses of network cameras (http://, rtsp://)")
    parser.add_argument("--hand", choices=("right", "left"), help="with --cameras: which hand (default right)")
    add_window_arguments(parser)
    add_examples(parser, "rhot --rig desk.json", "rhot --cameras left.mp4 right.mp4")


def add_window_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of every command that opens the window."""
    add_directory_argument(parser, f"private directory of the engine's sockets (default {default_directory()})")
    add_settings_argument(parser, "layout and settings")
    parser.add_argument("--reset", action="store_true", help="forget layout and settings first")


def run(args: argparse.Namespace) -> int:
    """Open the window and return its exit code when it is closed. Raises RigError and SourceError before there is a
    window."""
    rig = None if args.rig is None else load_rig(args.rig)
    if args.cameras is None:
        if args.hand is not None:
            raise SourceError("--hand goes with --cameras; a rig file names its hand itself.")
        return open_window(args, rig=args.rig, twin=None)
    from rhot_app.sources.cameras.camera_set import prepare
    from rhot_app.sources.cameras.camera_source import check_sources

    prepared = prepare(check_sources(args.cameras), base=rig, side=args.hand)
    for sentence in prepared.remarks:
        print(f"rhot: {sentence}", file=sys.stderr)
    return open_window(args, rig=prepared.rig_path, twin=None)


def _require_settings_file(path: Path) -> None:
    """Raises EngineError when settings cannot be kept there: Qt would replace a device or wait for a pipe."""
    try:
        require_replaceable(path)
    except OSError as exc:
        raise EngineError(f"--settings {path}: cannot be written ({exc.strerror}).") from exc


def open_window(args: argparse.Namespace, *, rig: Path | None, twin: TwinChoice | None) -> int:
    """Run the app: on `rig`, on the simulated rig `twin`, on the engine that runs already, or on what the settings say.

    Returns 0 when the window was closed. Everything that the app started has ended then.
    """
    if args.settings is not None:
        _require_settings_file(args.settings)
    choose_gl_platform()
    cap_software_gl()
    cap_heap()
    log_to_stderr()
    from rhot_app.ui.backend.session import Session

    session = Session(args.directory)
    from rhot_app.ui.common.job import workers

    workers()
    give_way()
    from PySide6.QtCore import Qt, QTimer
    from PySide6.QtWidgets import QApplication

    from rhot_app.ui.common.controller import Controller
    from rhot_app.ui.common.settings import Settings
    from rhot_app.ui.common.theme import apply_theme, scheme_named
    from rhot_app.ui.language import use_language
    from rhot_app.ui.main_window import MainWindow
    from rhot_app.ui.scene.surface import choose_format

    settings = Settings(args.settings)
    if args.reset:
        settings.reset()
    # pyqtgraph keeps its shaders for the first context that it meets
    QApplication.setAttribute(Qt.ApplicationAttribute.AA_ShareOpenGLContexts)
    app = QApplication.instance() or QApplication(sys.argv[:1])
    assert isinstance(app, QApplication)
    app.setApplicationName("RHOT")
    choose_format()
    use_language(settings.language)
    apply_theme(app, scheme_named(settings.scheme))
    controller = Controller(session)
    window = MainWindow(controller, settings)
    for number in (signal.SIGINT, signal.SIGTERM):
        # a handler may run in the middle of a drawing, so closing waits for its turn
        signal.signal(number, lambda *_: QTimer.singleShot(0, window.close))
    compilation = BackgroundCompilation()
    watch = QTimer(interval=COMPILATION_MS)
    watch.timeout.connect(lambda: follow_compilation(compilation, controller))
    watch.start()
    window.show()
    if twin is not None:
        window.open_twin(twin)
    elif rig is not None:
        window.open_rig(rig)
    elif session.found():
        controller.attach()
    else:
        window.open_as_chosen()
    code = app.exec()
    compilation.close()
    left_running = controller.shut_down()
    if left_running:
        print(left_running)
    return leave(int(code))


def leave(code: int, timeout_s: float = LEAVE_S) -> int:
    """End the work under way and give back `code`. Work that cannot be cancelled, such as a compiler's, ends with the
    process, here: the interpreter's own end would wait for its thread."""
    from rhot_app.ui.common.job import end_jobs

    stuck = end_jobs(timeout_s)
    if stuck:
        log.warning("still at work when the app ended: %s", ", ".join(stuck))
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
    return code


COMPILATION_MS = 500


def follow_compilation(compilation: BackgroundCompilation, controller: Controller) -> None:
    """Compile the rest of the numerical code once a rig is open, or nobody opens one, and say how far it is."""
    if not controller.working:
        compilation.start()
    controller.background = compilation.advice


# -- what must be settled before Qt and OpenGL are imported ------------------------------------------------------------

NICENESS = 5
"""A redraw must never delay a sample: the app yields to the engine and to the nodes."""


def choose_gl_platform() -> None:
    """Make PyOpenGL use the same window system as Qt; it looks at other variables than Qt does. An own choice stays.

    PyOpenGL takes EGL on Wayland and GLX on X11; Qt follows ``QT_QPA_PLATFORM``, and XWayland makes both look possible.
    """
    if not sys.platform.startswith("linux") or os.environ.get("PYOPENGL_PLATFORM"):
        return
    platform = os.environ.get("QT_QPA_PLATFORM", "").split(":")[0].split(";")[0]
    if not platform:
        platform = "wayland" if os.environ.get("WAYLAND_DISPLAY") else "xcb"
    os.environ["PYOPENGL_PLATFORM"] = "glx" if platform == "xcb" else "egl"


def cap_software_gl() -> None:
    """Mesa's software renderer takes every core unless told otherwise; one is enough here, the rest is the engine's."""
    os.environ.setdefault("LP_NUM_THREADS", "1")


M_MMAP_THRESHOLD, M_ARENA_MAX = -3, -8  # of malloc.h
PICTURE_BYTES = 1 << 17
"""What is as large as a picture goes back to the system when it is freed: glibc's own first threshold."""


def cap_heap() -> None:
    """One heap for all threads, with nothing large in it. By default glibc gives every thread one, up to eight a core,
    which stays as large as pictures have made it, and soon keeps blocks of megabytes. Other libraries are left alone.
    """
    with contextlib.suppress(OSError, AttributeError):
        library = ctypes.CDLL(None)
        library.mallopt(M_ARENA_MAX, 1)
        library.mallopt(M_MMAP_THRESHOLD, PICTURE_BYTES)


def give_way() -> None:
    """Lower this process's priority; where that is not allowed, nothing is lost but smoothness."""
    with contextlib.suppress(OSError, AttributeError):
        os.nice(NICENESS)
