"""The three-dimensional scene: pure geometry (`frames`, `meshes`, `hand_mesh`) apart from what draws it with OpenGL."""
