"""What ``rhot calibrate stereo`` prints: the fields of its JSON object, and lines for people."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from rhot_app.calibration.robust_error import what_is_reported
from rhot_app.calibration.stereo.report import MARKER_NOISE_PX, WORKING_DISTANCE_M, PairFigures, StereoReport
from rhot_app.calibration.stereo.world_frame import WorldFrame

LENS_NAMES = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")


def fields_of(report: StereoReport, frame: WorldFrame | None) -> dict[str, Any]:
    """The JSON's fields; those of the first pair stand at the top. None where nothing was solved."""
    rejected = [{"name": each.name, "reason": each.reason, "code": each.code} for each in report.dropped]
    figures = report.figures
    if figures is None:
        names = ("rms_px", "baseline_mm", "rotation_rad", "translation_mm", "square_mm_triangulated", "epipolar_px")
        return {**dict.fromkeys(names), "cameras": [{"name": name} for name in report.cameras], "pairs": [],
                "views_used": 0, "views_rejected": rejected}
    pairs = [_pair(pair) for pair in figures.pairs]
    squares, (by_rig, by_noise) = figures.squares, figures.error_m
    return {
        "rms_px": figures.rms_px, "noise_px": figures.noise_px, **pairs[0],
        "square_mm_triangulated": squares.mean_m * 1e3, "square_std_mm": squares.std_m * 1e3,
        "flatness_mm": squares.flatness_m * 1e3,
        "board_error_mm": None if figures.board_errors is None else {
            "in_plane": figures.board_errors.in_plane_m * 1e3, "across": figures.board_errors.across_m * 1e3},
        "expected_error_mm": {"distance_m": WORKING_DISTANCE_M, "by_calibration": _number(by_rig * 1e3),
                              "marker_noise_px": MARKER_NOISE_PX, "by_marker_noise": _number(by_noise * 1e3)},
        "std_method": "inverse of the bundle adjustment's normal equations at the corners' own spread, times the "
        "disagreement of the shots",
        "disagreement": figures.error_inflation,
        "cameras": [_camera(report, i) for i in range(len(figures.cameras))], "pairs": pairs,
        "views_used": len(figures.shots), "views_rejected": rejected,
        "shots": [{"name": shot.name, "rms_px": [_number(rms) for rms in shot.rms_px]} for shot in figures.shots],
        "ruler_mm": None if figures.ruler is None else {
            "said": figures.ruler.said_m * 1e3, "measured": figures.ruler.measured_m * 1e3,
            "std": figures.ruler.std_m * 1e3},
        "lengths": figures.lengths,
        "table": None if frame is None else _table(frame),
    }


def lines_of(report: StereoReport, frame: WorldFrame | None) -> list[str]:
    """The figures for people."""
    figures = report.figures
    lines = [f"left out: {each.name}: {each.reason}" for each in report.dropped]
    if figures is None:
        return lines
    for camera in figures.cameras:
        fx, fy, cx, cy = camera.lens[:4]
        sfx, _, scx, scy = camera.lens_std[:4]
        lines.append(f"{camera.name}: f {fx:.2f}, {fy:.2f} +- {sfx:.2f} px, centre ({cx:.2f} +- {scx:.2f}, "
                     f"{cy:.2f} +- {scy:.2f}) px, rms {camera.rms_px:.3f} px")
    for pair in figures.pairs:
        shift, shift_std = _listed(pair.translation_m * 1e3), _listed(pair.translation_std_m * 1e3)
        lines.append(f"{pair.first} to {pair.second}: {pair.baseline_m * 1e3:.2f} mm; T ({shift}) +- ({shift_std}) mm, "
                     f"R ({_listed(pair.rotation_rad, 4)}) rad, epipolar {pair.epipolar_px:.2f} px")
    lines.append(what_is_reported(figures.error_inflation))
    squares = figures.squares
    lines.append(f"squares as the cameras see them: {squares.mean_m * 1e3:.3f} +- {squares.std_m * 1e3:.3f} mm, board "
                 f"flat to {squares.flatness_m * 1e3:.2f} mm")
    if figures.board_errors is not None:
        lines.append(f"the board's corners are {figures.board_errors.in_plane_m * 1e3:.2f} mm off in its plane and "
                     f"{figures.board_errors.across_m * 1e3:.2f} mm across; allowed for")
    lines.append(f"a marker {WORKING_DISTANCE_M:g} m away: {figures.error_m[0] * 1e3:.1f} mm uncertain by this "
                 f"calibration, {figures.error_m[1] * 1e3:.1f} mm by {MARKER_NOISE_PX:g} px of noise")
    if frame is not None:
        lines += [f"{each.name}: {each.height_m * 1e3:.0f} mm above the table, looks down by "
                  f"{math.degrees(each.down_rad):.1f} degrees" for each in frame.stances]
    return lines


def _camera(report: StereoReport, index: int) -> dict[str, Any]:
    assert report.figures is not None
    camera = report.figures.cameras[index]
    values = [float(value) for value in camera.lens]
    return {"name": camera.name, **dict(zip(LENS_NAMES[:4], values[:4], strict=True)), "distortion": values[4:],
            "size": list(camera.size), "rms_px": camera.rms_px,
            "std": dict(zip(LENS_NAMES, [float(std) for std in camera.lens_std], strict=True))}


def _pair(pair: PairFigures) -> dict[str, Any]:
    return {"first": pair.first, "second": pair.second, "baseline_mm": pair.baseline_m * 1e3,
            "rotation_rad": _list(pair.rotation_rad), "rotation_std_rad": _list(pair.rotation_std_rad),
            "translation_mm": _list(pair.translation_m * 1e3),
            "translation_std_mm": _list(pair.translation_std_m * 1e3),
            "epipolar_px": _number(pair.epipolar_px), "shared": pair.shared}


def _table(frame: WorldFrame) -> dict[str, Any]:
    return {"rms_px": frame.rms_px,
            "cameras": [{"name": each.name, "height_mm": each.height_m * 1e3, "down_deg": math.degrees(each.down_rad),
                         "roll_deg": math.degrees(each.roll_rad)} for each in frame.stances]}


def _list(values: Iterable[float]) -> list[float]:
    return [float(value) for value in values]


def _listed(values: Iterable[float], digits: int = 2) -> str:
    return ", ".join(f"{value:.{digits}f}" for value in values)


def _number(value: float) -> float | None:
    """JSON knows no NaN."""
    return float(value) if math.isfinite(value) else None
