"""Boards as files of other programs state them: Kalibr's target and caliscope's ``charuco.toml``."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from rhot_app.calibration.board.boards import DEFAULT_DICTIONARY, Board, CharucoBoard, Chessboard
from rhot_app.calibration.exchange.documents import Entry, read_table
from rhot_app.errors import CalibrationError

SUFFIXES: Final = (".yaml", ".yml", ".toml")
"""Of a board's file, which stands where a board's size may stand, too."""

_INCH_CM: Final = 2.54


def read_board(path: Path) -> Board:
    """The board of a file. Raises CalibrationError: a kind that is not read, or numbers that no board has."""
    document = read_table(path)
    if document.has("target_type"):
        return _kalibr(document)
    table = document["charuco"] if document.has("charuco") else document
    if table.has("columns") and table.has("aruco_scale"):
        return _caliscope(table)
    raise CalibrationError(f"{path}: no board of Kalibr (target_type) or caliscope (charuco).")


def _kalibr(target: Entry) -> Chessboard:
    """Rows and columns of inner corners."""
    kind = target["target_type"].text
    if kind != "checkerboard":
        raise CalibrationError(f"{target.file}: the target is of the kind {kind!r}, which is not found in pictures "
                               "here. Print a chessboard or a ChArUco board (rhot target).")
    across, down = (_number(target[f"{side}SpacingMeters"]) for side in ("col", "row"))
    if across != down:
        raise CalibrationError(f"{target.file}: its squares are {1e3 * across:g} x {1e3 * down:g} mm; they must be "
                               "square.")
    return Chessboard(target["targetCols"].whole, target["targetRows"].whole, across)


def _caliscope(board: Entry) -> CharucoBoard:
    """Columns and rows of squares, which are as large as was measured, or as the paper allows."""
    columns, rows = board["columns"].whole, board["rows"].whole
    if board.has("square_size_overide_cm"):
        square_cm = _number(board["square_size_overide_cm"])
    else:
        unit = _INCH_CM if board["units"].text == "inch" else 1.0
        square_cm = unit * min(_number(board["board_height"]) / max(rows, 1),
                               _number(board["board_width"]) / max(columns, 1))
    dictionary = board["dictionary"].text if board.has("dictionary") else DEFAULT_DICTIONARY
    return CharucoBoard(columns, rows, 1e-2 * square_cm, 1e-2 * square_cm * _number(board["aruco_scale"]), dictionary,
                        board.has("legacy_pattern") and board["legacy_pattern"].value is True)


def _number(length: Entry) -> float:
    return float(length.numbers(1)[0])
