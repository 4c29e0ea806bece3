"""The desktop app, a client of the engine. The only room that imports Qt, pyqtgraph and OpenGL."""
