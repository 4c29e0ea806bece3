"""The master: triangulates what the nodes see, solves the hand, serves it to the screen and to other programs."""

import rhot_node  # noqa: F401 - decides where compiled code is kept, before anything here loads numba
