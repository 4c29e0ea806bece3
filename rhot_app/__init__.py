"""The master: triangulates what the nodes see, solves the hand, serves it to the screen and to other programs."""

import os

# Before numpy loads. The matrices of a hand are small: a second thread of OpenBLAS only waits busily for the first one.
# Bones from markers take a fifth of the processor's time without it, and the tracker keeps its core to itself.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import rhot_node  # noqa: F401 - decides where compiled code is kept, before anything here loads numba
