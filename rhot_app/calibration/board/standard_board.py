"""The default calibration board, as numbers: it is printed, shown, detected and assumed unless another one is named.

Nothing is imported, so that commands can name it in their help at no cost.
"""

from __future__ import annotations

from typing import Final

BOARD: Final = "9x6"
"""Inner corners of the chessboard: 10 x 7 squares."""

CHARUCO: Final = "10x7"
"""Squares of the ChArUco board: as large as the chessboard."""

TAGS: Final = "7x5"
"""Tags of the AprilGrid: 235 x 170 mm with the squares around."""

TAG_SPACING: Final = 0.3
"""Between two tags, as a part of their side: as on Kalibr's own boards."""

TAG_BITS: Final = 6
"""Along a side of a tag of the family 36h11, without its border."""

TAG_BORDER_BITS: Final = 2
"""Black bits around a tag, as Kalibr prints them; other programs print one."""

CIRCLES: Final = "4x11"
"""Circles in a row, and rows, of the asymmetric grid: 180 x 240 mm."""

SPACING_MM: Final = 20.0
"""Between two rows of circles."""

CIRCLE_DIAMETER: Final = 1.0
"""Diameter of a circle as drawn, as a share of the spacing. It is measured in the pictures."""

SQUARE_MM: Final = 25.0
"""Side of a square as drawn, mm: 250 x 175 mm fit on A4 and on letter paper. Printers scale, so measure it."""

MARKER_SHARE: Final = 0.75
"""Side of a ChArUco marker, as a share of its square's side."""

KINDS: Final = {"chessboard": (BOARD, SQUARE_MM), "charuco": (CHARUCO, SQUARE_MM), "aprilgrid": (TAGS, SQUARE_MM),
                "circles": (CIRCLES, SPACING_MM)}
"""Usual size of each kind of board, and the length that is measured, mm: a square, a tag, or the spacing of circles."""
