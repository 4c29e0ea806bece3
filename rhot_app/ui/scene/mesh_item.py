"""One OpenGL item that draws one posed mesh: solid, translucent or hatched per vertex, in two draw calls.

pyqtgraph's own mesh item keeps one look for the whole mesh and blends every triangle with the ones behind it, so a
translucent finger would show its own far side. This one first fills the depth buffer and then colours only the
nearest surface.
"""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray
from OpenGL import GL
from OpenGL.GL import shaders
from pyqtgraph.opengl.GLGraphicsItem import GLGraphicsItem
from PySide6.QtGui import QOpenGLContext
from PySide6.QtOpenGL import QOpenGLBuffer

from rhot_app.ui.scene.meshes import Faces

Array = NDArray[np.float64]
Colours = NDArray[np.uint8]

HATCH_PERIOD_PX = 7.0

_NEAREST = 0.02
"""Share of the depth range, nearest to the eye, into which what is drawn over everything is brought."""

_VERTEX = """
uniform mat4 u_mvp;
uniform mat3 u_normal;
uniform float u_depth;
attribute vec3 a_position;
attribute vec3 a_normal;
attribute vec4 a_colour;
attribute float a_hatched;
varying vec3 v_normal;
varying vec4 v_colour;
varying float v_hatched;
void main() {
    v_normal = u_normal * a_normal;
    v_colour = a_colour;
    v_hatched = a_hatched;
    gl_Position = u_mvp * vec4(a_position, 1.0);
    gl_Position.z = mix(-gl_Position.w, gl_Position.z, u_depth);
}
"""

_FRAGMENT = """
uniform float u_period;
uniform float u_lit;
varying vec3 v_normal;
varying vec4 v_colour;
varying float v_hatched;
void main() {
    vec3 n = normalize(v_normal);
    if (n.z < 0.0) n = -n;
    float diffuse = max(dot(n, normalize(vec3(-0.35, 0.55, 0.75))), 0.0);
    float light = mix(1.0, 0.42 + 0.62 * diffuse, u_lit);
    float rim = u_lit * pow(1.0 - n.z, 3.0);
    float edge = 0.35 * rim * (1.0 - v_colour.a) * min(1.0, 4.0 * v_colour.a);
    vec4 colour = vec4(v_colour.rgb * light + 0.12 * rim, v_colour.a + edge);
    if (v_hatched > 0.5) {
        float stripe = step(0.5, fract((gl_FragCoord.x + gl_FragCoord.y) / u_period));
        colour = vec4(colour.rgb * mix(0.62, 1.0, stripe), colour.a * mix(0.45, 1.0, stripe));
    }
    gl_FragColor = colour;
}
"""

_UNIFORMS = ("u_mvp", "u_normal", "u_period", "u_lit", "u_depth")
_ATTRIBUTES = ("a_position", "a_normal", "a_colour", "a_hatched")


def _modern(source: str, fragment: bool) -> str:
    """The same shader in the words of GLSL 1.40 and ES 3.00, which core profiles demand."""
    if fragment:
        return "out vec4 f_colour;\n" + source.replace("varying", "in").replace("gl_FragColor", "f_colour")
    return source.replace("attribute", "in").replace("varying", "out")


@functools.cache
def _program() -> tuple[int, dict[str, int]]:
    """The one program of all items and the places of its uniforms, for the dialect of the context that comes first.

    The window's contexts share their programs (AA_ShareOpenGLContexts), and one that an item made for itself would stay
    when the item goes: with a software renderer that is megabytes of compiled code.
    """
    form = QOpenGLContext.currentContext().format()
    version = (form.majorVersion(), form.minorVersion())
    if QOpenGLContext.currentContext().isOpenGLES():
        modern, head = version >= (3, 0), "#version 300 es\nprecision highp float;\n"
    else:
        modern, head = version >= (3, 1), "#version 140\n"
    vertex, fragment = ((_modern(_VERTEX, False), _modern(_FRAGMENT, True)) if modern else (_VERTEX, _FRAGMENT))
    head = head if modern else ("precision highp float;\n" if QOpenGLContext.currentContext().isOpenGLES() else "")
    program = shaders.compileProgram(shaders.compileShader(head + vertex, GL.GL_VERTEX_SHADER),
                                     shaders.compileShader(head + fragment, GL.GL_FRAGMENT_SHADER), validate=False)
    for place, name in enumerate(_ATTRIBUTES):
        GL.glBindAttribLocation(program, place, name)
    GL.glLinkProgram(program)
    return int(program), {name: GL.glGetUniformLocation(program, name) for name in _UNIFORMS}


class MeshItem(GLGraphicsItem):
    """`faces` are set once; `set_vertices` every frame. Nothing is drawn before the first vertices.

    `lit` False draws flat colours; `behind` True draws under everything drawn later, whatever its depth (shadows);
    `through` True draws over everything drawn before, whatever its depth, but itself in the right order.
    """

    def __init__(self, faces: Faces, *, lit: bool = True, behind: bool = False,
                 through: bool = False) -> None:
        super().__init__()
        self._faces = np.ascontiguousarray(faces, dtype=np.uint32)
        self._lit = lit
        self._behind = behind
        self._through = through
        self._arrays: list[NDArray[np.generic]] | None = None
        self._dirty = False
        self._see_through = False
        self._buffers: list[QOpenGLBuffer] = []
        self._indices = QOpenGLBuffer(QOpenGLBuffer.Type.IndexBuffer)

    def set_vertices(self, vertices: Array, normals: Array, colours: Colours, hatched: NDArray[np.bool_]) -> None:
        """Vertices and normals (N, 3), colours (N, 4) bytes, hatched (N,); uploaded at the next drawing."""
        self._arrays = [np.ascontiguousarray(vertices, np.float32), np.ascontiguousarray(normals, np.float32),
                        np.ascontiguousarray(colours, np.uint8), np.ascontiguousarray(hatched, np.float32)]
        self._dirty = True
        self._see_through = bool((colours[:, 3] < 255).any())

    @property
    def vertices(self) -> Array:
        """(N, 3) as they were set last; none before."""
        return np.empty((0, 3)) if self._arrays is None else self._arrays[0].astype(np.float64)

    @property
    def colours(self) -> Colours:
        """(N, 4) bytes as they were set last; none before."""
        return np.empty((0, 4), np.uint8) if self._arrays is None else self._arrays[2].astype(np.uint8)

    def initializeGL(self) -> None:  # noqa: N802 (Qt's name)
        """Make the buffers in the current context."""
        self._buffers = [QOpenGLBuffer(QOpenGLBuffer.Type.VertexBuffer) for _ in _ATTRIBUTES]
        self._indices = QOpenGLBuffer(QOpenGLBuffer.Type.IndexBuffer)
        self._indices.create()
        self._indices.bind()
        self._indices.allocate(self._faces.tobytes(), self._faces.nbytes)
        self._indices.release()
        self._dirty = self._arrays is not None

    def _upload(self) -> None:
        assert self._arrays is not None
        for buffer, array in zip(self._buffers, self._arrays, strict=True):
            if not buffer.isCreated():
                buffer.create()
            buffer.bind()
            if buffer.size() == array.nbytes:
                buffer.write(0, array.tobytes(), array.nbytes)  # type: ignore[arg-type]
            else:
                buffer.allocate(array.tobytes(), array.nbytes)
            buffer.release()
        self._dirty = False

    def paint(self) -> None:
        """Draw the nearest surface; when anything of it is see-through, its depth alone first."""
        if self._arrays is None or not len(self._faces):
            return
        if self._dirty:
            self._upload()
        program, places = _program()
        GL.glUseProgram(program)
        self._set_uniforms(places)
        self._enable_attributes()
        self._indices.bind()
        GL.glEnable(GL.GL_BLEND)
        GL.glBlendFuncSeparate(GL.GL_SRC_ALPHA, GL.GL_ONE_MINUS_SRC_ALPHA, GL.GL_ONE, GL.GL_ONE_MINUS_SRC_ALPHA)
        if self._behind:
            GL.glDisable(GL.GL_DEPTH_TEST)
            self._draw()
        else:
            self._draw_nearest()
        self._indices.release()
        for place in range(len(_ATTRIBUTES)):
            GL.glDisableVertexAttribArray(place)
        GL.glUseProgram(0)

    def _draw_nearest(self) -> None:
        GL.glEnable(GL.GL_DEPTH_TEST)
        GL.glDisable(GL.GL_CULL_FACE)
        if self._see_through:
            GL.glDepthFunc(GL.GL_LESS)
            GL.glColorMask(False, False, False, False)
            self._draw()
            GL.glColorMask(True, True, True, True)
        GL.glDepthFunc(GL.GL_LEQUAL)
        self._draw()
        GL.glDepthFunc(GL.GL_LESS)

    def _draw(self) -> None:
        GL.glDrawElements(GL.GL_TRIANGLES, self._faces.size, GL.GL_UNSIGNED_INT, None)

    def _set_uniforms(self, at: dict[str, int]) -> None:
        mvp = np.array(self.mvpMatrix().data(), dtype=np.float32)
        normal = np.array(self.modelViewMatrix().normalMatrix().data(), dtype=np.float32)
        GL.glUniformMatrix4fv(at["u_mvp"], 1, False, mvp)
        GL.glUniformMatrix3fv(at["u_normal"], 1, False, normal)
        GL.glUniform1f(at["u_period"], HATCH_PERIOD_PX * self.view().devicePixelRatioF())
        GL.glUniform1f(at["u_lit"], 1.0 if self._lit else 0.0)
        GL.glUniform1f(at["u_depth"], _NEAREST if self._through else 1.0)

    def _enable_attributes(self) -> None:
        kinds = ((3, GL.GL_FLOAT, False), (3, GL.GL_FLOAT, False), (4, GL.GL_UNSIGNED_BYTE, True),
                 (1, GL.GL_FLOAT, False))
        for place, (buffer, (size, kind, normalized)) in enumerate(zip(self._buffers, kinds, strict=True)):
            buffer.bind()
            GL.glVertexAttribPointer(place, size, kind, normalized, 0, None)
            GL.glEnableVertexAttribArray(place)
            buffer.release()
