"""The default calibration board, as numbers: it is printed, shown, detected and assumed unless another one is named.

Nothing is imported, so that commands can name it in their help at no cost.
"""

from __future__ import annotations

from typing import Final

BOARD: Final = "9x6"
"""Inner corners of the chessboard: 10 x 7 squares."""

CHARUCO: Final = "10x7"
"""Squares of the ChArUco board: as large as the chessboard."""

SQUARE_MM: Final = 25.0
"""Side of a square as drawn, mm: 250 x 175 mm fit on A4 and on letter paper. Printers scale, so measure it."""

MARKER_SHARE: Final = 0.75
"""Side of a ChArUco marker, as a share of its square's side."""
