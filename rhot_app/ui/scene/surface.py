"""Which OpenGL there is: hardware gets smooth edges, a software renderer gets speed instead."""

from __future__ import annotations

from OpenGL import GL
from PySide6.QtGui import QOffscreenSurface, QOpenGLContext, QSurfaceFormat

SAMPLES = 4
_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "software")


def renderer_name() -> str:
    """Name of the OpenGL renderer, "" when there is none."""
    context = QOpenGLContext()
    surface = QOffscreenSurface()
    surface.create()
    if not context.create() or not context.makeCurrent(surface):
        return ""
    name = GL.glGetString(GL.GL_RENDERER)
    context.doneCurrent()
    return name.decode(errors="replace") if isinstance(name, bytes) else ""


def is_software(renderer: str) -> bool:
    """Whether the processor draws."""
    return any(word in renderer.lower() for word in _SOFTWARE)


def choose_format() -> str:
    """Set the default surface format before the first scene is made; returns the renderer's name."""
    renderer = renderer_name()
    form = QSurfaceFormat.defaultFormat()
    form.setDepthBufferSize(24)
    form.setSamples(0 if not renderer or is_software(renderer) else SAMPLES)
    QSurfaceFormat.setDefaultFormat(form)
    return renderer
