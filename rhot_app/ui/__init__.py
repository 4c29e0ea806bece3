"""The desktop app: a client of the engine process. The only folder that imports Qt, pyqtgraph and OpenGL.

`models` and `backend` are Qt-free: what is shown, in which words, and which processes run. `panels`, `plots` and
`scene` are the widgets that show it.
"""
