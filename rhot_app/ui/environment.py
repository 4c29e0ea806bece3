"""What must be settled before Qt and OpenGL are imported. Import this module first; it imports neither."""

from __future__ import annotations

import contextlib
import os
import sys

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


def give_way() -> None:
    """Lower this process's priority; where that is not allowed, nothing is lost but smoothness."""
    with contextlib.suppress(OSError, AttributeError):
        os.nice(NICENESS)
