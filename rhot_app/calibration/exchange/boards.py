"""Boards as files of other programs state them: Kalibr's target, caliscope's ``charuco.toml``, anipose's
``config.toml``."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from rhot_app.calibration.board.boards import (
    DEFAULT_DICTIONARY,
    AprilGrid,
    Board,
    CharucoBoard,
    Chessboard,
    CircleGrid,
)
from rhot_app.calibration.board.standard_board import KINDS
from rhot_app.calibration.exchange.documents import Entry, read_table
from rhot_app.errors import CalibrationError
from rhot_node.errors import printable

SUFFIXES: Final = (".yaml", ".yml", ".toml")
"""Of a board's file, which stands where a board's size may stand, too."""

_INCH_CM: Final = 2.54


def read_board(path: Path) -> Board:
    """The board of a file. Raises CalibrationError: a kind that is not read, or numbers that no board has."""
    document = read_table(path)
    if document.has("target_type"):
        return _kalibr(document)
    if document.has("calibration") and document["calibration"].has("board_type"):
        return _anipose(document["calibration"])
    table = document["charuco"] if document.has("charuco") else document
    if table.has("columns") and table.has("aruco_scale"):
        return _caliscope(table)
    raise CalibrationError(f"{path}: no board of Kalibr (target_type), caliscope (charuco) or anipose "
                           "(calibration.board_type).")


def _kalibr(target: Entry) -> Board:
    """Rows and columns of inner corners, of tags, or of circles, in metres."""
    kind = target["target_type"].text
    if kind == "aprilgrid":
        return AprilGrid(target["tagCols"].whole, target["tagRows"].whole, _number(target["tagSize"]),
                         _number(target["tagSpacing"]))
    if kind == "circlegrid":
        if target["asymmetricGrid"].value is not True:
            raise _unread(target, "circlegrid with the same rows (asymmetricGrid: False), which looks the same turned")
        return CircleGrid(target["targetCols"].whole, target["targetRows"].whole, _number(target["spacingMeters"]))
    if kind != "checkerboard":
        raise _unread(target, repr(kind))
    across, down = (_number(target[f"{side}SpacingMeters"]) for side in ("col", "row"))
    if across != down:
        raise CalibrationError(f"{target.file}: its squares are {1e3 * across:g} x {1e3 * down:g} mm; they must be "
                               "square.")
    return Chessboard(target["targetCols"].whole, target["targetRows"].whole, across)


def _unread(board: Entry, kind: str) -> CalibrationError:
    return CalibrationError(f"{board.file}: the board is of the kind {printable(kind)}, which is not found in pictures "
                            f"here. rhot target draws those that are: {', '.join(KINDS)}.")


def _anipose(board: Entry) -> Board:
    """`board_size` as aniposelib gives it to OpenCV: a checkerboard's inner corners, a ChArUco board's squares; mm."""
    kind = board["board_type"].text.lower()
    size = board["board_size"]
    across, down = size.numbers(2).tolist()
    if across % 1.0 or down % 1.0:
        raise size.wrong("is not two whole numbers.")
    if kind not in ("charuco", "checkerboard"):
        raise _unread(board, repr(kind))
    square_m = 1e-3 * _number(board["board_square_side_length"])
    if kind == "checkerboard":
        return Chessboard(int(across), int(down), square_m)
    bits, count = board["board_marker_bits"].whole, board["board_marker_dict_number"].whole
    return CharucoBoard(int(across), int(down), square_m, 1e-3 * _number(board["board_marker_length"]),
                        f"DICT_{bits}X{bits}_{count}")


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
