"""What to think of the figures of a stereo calibration, finding by finding.

Mirroring of all cameras at once cannot be seen in a plain chessboard: the mirrored world is as rigid as the real one.
It shows in the arrangement - left would stand on the right - and in lenses that were calibrated apart.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rhot_app.calibration.board.shared_views import Dropped
from rhot_app.calibration.bundle.robust_error import in_words
from rhot_app.calibration.stereo.adjust import ALIKE_RAD
from rhot_app.calibration.stereo.points import LensEvidence
from rhot_app.calibration.stereo.result import WORKING_DISTANCE_M, StereoFigures
from rhot_app.calibration.verdict import Finding, Grade
from rhot_app.geometry.transforms import inverse

FAIR_PX, POOR_PX = 0.6, 1.5
"""Rms of the corners in a picture of 800 px diagonal (640x480)."""

_DIAGONAL_PX = 800.0
_GOOD_SHOTS = 8
_FAIR_ERROR_M, _POOR_ERROR_M = 0.002, 0.010
_SQUARE_FAIR, _SQUARE_POOR = 0.005, 0.02
_FLATNESS = 0.005  # of the board's diagonal, and
_BOARD_OFF = 0.01  # of a square's side
_BEYOND_NOISE = 2.0  # times what the noise of the corners explains
_NEAREST_M, _NEAR_M, _FAR_M = 0.08, 0.15, 4.0
"""Where a board is held before cameras that look at hands: other distances mean squares of another size than said."""


def fit_findings(figures: StereoFigures, *, lenses_from_views: bool) -> list[Finding]:
    """How well the corners fit, how much they say, and what comes out in space."""
    found: list[Finding | None] = []
    if len(figures.shots) < _GOOD_SHOTS:
        found.append(Finding("few_views", Grade.FAIR, f"Only {len(figures.shots)} shots were used.",
                             remedy="Take 15, with the board near and far, tilted, and in all corners."))
    if figures.tilt_rad < ALIKE_RAD:
        found.append(Finding(
            "alike", Grade.POOR if lenses_from_views else Grade.FAIR,
            f"The views are all alike: the board is tilted by {np.degrees(figures.tilt_rad):.0f} degrees at most "
            "between any two.",
            "Focal length and distance then look the same to the cameras.",
            "Tilt the board by 30 degrees to either side, up and down, and move it near and far."))
    found += [_rms(figures), _scale(figures), _squares(figures), _error(figures), _board(figures)]
    return [each for each in found if each is not None]


def arrangement_findings(figures: StereoFigures, evidence: LensEvidence) -> list[Finding]:
    """Whether left is on the left, and the pictures are as the lenses saw them."""
    pair = _left_and_right(figures)
    reversed_ = pair is not None and pair[2] < 0.0
    if evidence.all_mirrored:
        return [_mirrored("their corners fit the mirrored lenses better than the given ones")]
    if reversed_ and pair is not None:
        return [_swapped(pair, certain=evidence.swapped)]
    if evidence.swapped:
        return [Finding("lenses_swapped", Grade.POOR,
                        "The pictures of each camera fit the intrinsics of the other one better than its own.",
                        "The two intrinsics files are swapped, or the pictures and the names of the cameras.",
                        "Exchange the two intrinsics files.")]
    return []


def dropped_findings(dropped: Sequence[Dropped], used: int) -> list[Finding]:
    """What was left out, one finding per kind; empty pictures of a board that was not there are no fault."""
    names = {"order": "out of order", "apart": "not of one moment", "residual": "not fitting", "file": "unreadable",
             "no_partner": "without partner"}
    remedies = {"order": "Look at the file names: pictures of the same moment need the same number.",
                "apart": "Hold the board still while both cameras expose.",
                "residual": "Hold the board still, and use a stiff one.",
                "file": "Take that picture again.",
                "no_partner": "Each picture needs one of the other camera with the same number."}
    found = []
    for code, words in names.items():
        those = [each for each in dropped if each.code == code]
        if those:
            listed = "; ".join(f"{each.name}: {each.reason}" for each in those[:3])
            more = f"; and {len(those) - 3} more" if len(those) > 3 else ""
            found.append(Finding(code, Grade.FAIR, f"Left out as {words}: {len(those)} of {used + len(dropped)} "
                                 f"({listed}{more}).", remedy=remedies[code]))
    return found


def _rms(figures: StereoFigures) -> Finding | None:
    scale = max(float(np.hypot(*camera.size)) for camera in figures.cameras) / _DIAGONAL_PX
    epipolar = max((pair.epipolar_px for pair in figures.pairs if np.isfinite(pair.epipolar_px)), default=0.0)
    worst = max(figures.rms_px, epipolar)
    if worst < FAIR_PX * scale:
        return None
    return Finding(
        "residual", Grade.POOR if worst > POOR_PX * scale else Grade.FAIR,
        f"The corners are {figures.rms_px:.2f} px off, the epipolar lines {epipolar:.2f} px (good: below "
        f"{FAIR_PX * scale:.1f}).",
        "The board is bent or moved while the pictures were taken, pictures are blurred, or the cameras do not expose "
        "together.",
        "Use a stiff board, hold it still for each picture, and give more light.")


def _scale(figures: StereoFigures) -> Finding | None:
    boards = figures.state.world_from_board @ np.append(figures.board.object_points().mean(axis=0), 1.0)
    away = boards[:, :3] - figures.world_from_camera[:, None, :3, 3]
    typical = float(np.median(np.linalg.norm(away, axis=-1)))
    if _NEAR_M <= typical <= _FAR_M:
        return None
    return Finding(
        "scale", Grade.POOR if typical < _NEAREST_M else Grade.FAIR,
        f"With {figures.board.parts} of {figures.board.square_m * 1e3:g} mm the board was held {typical * 100:.0f} cm "
        "from the cameras.",
        f"The {figures.board.parts} have another size: they are given in millimetres.",
        "Measure one with a ruler, and say with --baseline-mm how far the lenses are apart.")


def _squares(figures: StereoFigures) -> Finding | None:
    squares, side = figures.squares, figures.board.square_m
    off = abs(squares.mean_m / side - 1.0)
    diagonal = side * float(np.hypot(figures.board.cols - 1, figures.board.rows - 1))
    bent = squares.flatness_m > max(_FLATNESS * diagonal, _BEYOND_NOISE * squares.flatness_by_noise_m)
    if not off > _SQUARE_FAIR and not bent:
        return None
    return Finding(
        "squares", Grade.POOR if off > _SQUARE_POOR else Grade.FAIR,
        f"Seen by the cameras the {figures.board.parts} are {squares.mean_m * 1e3:.2f} ± "
        f"{squares.std_m * 1e3:.2f} mm (said: {side * 1e3:g}) and the board is flat to "
        f"{squares.flatness_m * 1e3:.2f} mm.",
        "The board is bent, or the cameras' geometry is not well determined.",
        "Use a stiff, flat board and take more pictures, also near and tilted.")


def _board(figures: StereoFigures) -> Finding | None:
    errors = figures.board_errors
    if errors is None or max(errors.in_plane_m, errors.across_m) < _BOARD_OFF * figures.board.square_m:
        return None
    return Finding("board", Grade.FAIR, f"The board's corners are {errors.in_plane_m * 1e3:.2f} mm off in its plane "
                   f"and {errors.across_m * 1e3:.2f} mm across, as all pictures together show.",
                   "It is bent, or printed or glued unevenly. This was allowed for, as far as it did not change.",
                   "Use a flat, stiff board: glass, or paper glued to a plate without bubbles.")


def _error(figures: StereoFigures) -> Finding | None:
    error = figures.error_m[0]
    if error < _FAIR_ERROR_M:
        return None
    figure = f"No two cameras see a point {WORKING_DISTANCE_M:.1f} m in front of them."
    if np.isfinite(error):
        figure = (f"A point {WORKING_DISTANCE_M:.1f} m away is uncertain by {error * 1e3:.1f} mm from the calibration "
                  f"alone (good: below {_FAIR_ERROR_M * 1e3:.0f} mm).")
    return Finding(
        "uncertain", Grade.POOR if error >= _POOR_ERROR_M else Grade.FAIR, figure,
        in_words(figures.error_inflation) or "Too few or too similar pictures, or cameras that hardly look at the same "
        "place.",
        "Take more pictures of a stiff board that is laid against something, where hands will be, tilted to all sides.")


def _left_and_right(figures: StereoFigures) -> tuple[str, str, float] | None:
    """Left's and right's name, and how far right stands to the right of left in left's picture, m; None when no camera
    is called so, or they do not stand side by side."""
    names = [camera.name for camera in figures.cameras]
    if "left" not in names or "right" not in names:
        return None
    poses = figures.state.camera_from_world
    left_from_right = poses[names.index("left")] @ inverse(poses[names.index("right")])
    x, y, z = left_from_right[:3, 3]
    return ("left", "right", float(x)) if abs(x) > max(abs(y), abs(z)) else None


def _swapped(pair: tuple[str, str, float], *, certain: bool) -> Finding:
    left, right, offset = pair
    figure = f"{left.capitalize()} stands {-offset * 1e3:.0f} mm to the right of {right}."
    if certain:
        return Finding("swapped", Grade.POOR, figure, f"The pictures of {left} come from the camera on the right: they "
                       f"fit the intrinsics of {right}.", f"Exchange the pictures of {left} and {right}.")
    return Finding(
        "swapped_or_mirrored", Grade.POOR, figure,
        f"The cameras are swapped: the pictures of {left} come from the camera on the right. Pictures that both "
        "cameras deliver mirrored or upside down look the same: a chessboard cannot tell.",
        f"Exchange the pictures of {left} and {right}; when text in the pictures reads backwards, switch the mirroring "
        "off (hflip, selfie view) and take them again instead.")


def _mirrored(why: str) -> Finding:
    return Finding("mirrored", Grade.POOR, f"The pictures of all cameras are mirrored: {why}.",
                   "A driver or a setting (hflip, selfie view) mirrors them.",
                   "Switch the mirroring off and take the pictures again; never calibrate on flipped copies.")
