"""Whether a rig's lenses and poses are calibrated, and the error of positions that their calibration leaves.

``rhot check``, the engine's advice and the app all use these functions, so that they agree.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.check.health import HealthFinding
from rhot_app.calibration.verdict import Finding, Grade
from rhot_app.project import Intrinsics, Rig, RigNode

Array = NDArray[np.float64]

NOT_CALIBRATED = "Not calibrated: millimetres are not reliable."
_NO_TURN = 1e-9
"""Vector part of a rotation's quaternion below which a pose is nominal. No solve finds cameras that parallel."""


def calibration_finding(rig: Rig) -> HealthFinding | None:
    """The most serious fault of a rig's lenses and poses, with the calibration to do next; None without a known one."""
    if rig.depth.mode == "disparity":
        return HealthFinding("stereo", Finding(
            "disparity", Grade.FAIR, "Distances are estimates: the rig finds them from disparity, without a "
            "calibration.", remedy="A stereo calibration with a board (Calibrate menu) gives exact ones."))
    if rig.calibration is not None and rig.calibration.method == "exact":
        return None
    nominal = [node.name for node in rig.nodes if node.intrinsics.nominal]
    if nominal:
        exact = " The estimator takes them as exact." if rig.tracker.kind != "classic" else ""
        return HealthFinding("lens", Finding(
            "nominal", Grade.FAIR, NOT_CALIBRATED, f"The lenses of {' and '.join(nominal)} are nominal.{exact}",
            "Calibrate the intrinsics of each camera, then stereo."))
    apart = [node.name for node, used in zip(rig.nodes, rig.tracked_with, strict=True) if not used]
    if apart:
        return HealthFinding("stereo", Finding(
            "unknown_poses", Grade.FAIR, NOT_CALIBRATED, f"Where {' and '.join(apart)} stands is not known.",
            "Do the stereo calibration with a board."))
    if rig.calibration is not None and rig.calibration.method == "outdated":
        return HealthFinding("stereo", Finding(
            "outdated_poses", Grade.FAIR, NOT_CALIBRATED,
            "Intrinsics were calibrated anew after the stereo calibration.",
            "Repeat the stereo calibration with a board."))
    if rig.calibration is None and _poses_nominal(rig):
        return HealthFinding("stereo", Finding(
            "nominal_poses", Grade.FAIR, NOT_CALIBRATED, "The cameras' poses are nominal: none is turned.",
            "Do the stereo calibration with a board."))
    if rig.calibration is not None and rig.calibration.lengths == "skipped":
        return HealthFinding("stereo", lengths_finding())
    return None


def lengths_finding() -> Finding:
    """What is said when no second length was given."""
    return Finding("lengths_unproven", Grade.FAIR, "Lengths were never checked against a ruler.",
                   "If the board's squares are not as large as said, every length is wrong by the same factor.",
                   "Repeat the stereo calibration with a known length: lens to lens, or a ruler.")


def calibration_text(rig: Rig) -> str:
    """How the cameras were calibrated, in one line."""
    record = rig.calibration
    if record is None:
        return "not recorded"
    if record.method in ("exact", "outdated"):
        return ("exact, as simulated" if record.method == "exact" else
                "with a board, before intrinsics were calibrated anew")
    error = "" if record.error_m is None else f", ± {1e3 * record.error_m:.2f} mm at {record.distance_m:g} m"
    how = "refined from a moving hand" if record.method == "refined" else "with a board"
    return f"{how}{error}; lengths {lengths_text(rig)}"


def times_unknown(rig: Rig) -> list[str]:
    """Names of the tracked cameras whose times nobody has compared with the first one's. None of a simulated rig."""
    if rig.calibration is not None and rig.calibration.method == "exact":
        return []
    used = [node for node, tracked in zip(rig.nodes, rig.tracked_with, strict=True) if tracked]
    return [node.name for node in used[1:] if node.time_offset_sd_s is None]


def offset_text(node: RigNode) -> str:
    """What is added to a camera's times, and how well that is known."""
    sd_s = node.time_offset_sd_s
    return f"{1e3 * node.time_offset_s:.2f}" + (" ms, not measured" if sd_s is None else f" ± {1e3 * sd_s:.2f} ms")


def times_text(rig: Rig) -> str:
    """How far apart the cameras' times are, in a sentence."""
    if rig.calibration is not None and rig.calibration.method == "exact":
        return "As simulated."
    first, *others = rig.nodes
    unknown = [node.name for node in others if node.time_offset_sd_s is None]
    if unknown or not others:
        return (f"Not measured{' for ' if unknown else ''}{' and '.join(unknown)}: cameras that are not synchronised "
                "may be up to half a frame apart.")
    return " ".join(f"{node.name} against {first.name}: {offset_text(node)}." for node in others)


def lengths_text(rig: Rig) -> str:
    """How the size of the board's squares was checked against a second known length, in a few words."""
    record = rig.calibration
    if record is None:
        return "not recorded"
    if record.method == "exact":
        return "exact, as simulated"
    return {"skipped": "never checked against a ruler", "baseline": "checked by the baseline",
            "ruler": "checked by a ruler"}[record.lengths]


def with_lens(rig: Rig, camera: str, lens: Intrinsics) -> Rig:
    """`rig` with another lens of `camera`; its calibration record then says that the poses are outdated."""
    nodes = tuple(msgspec.structs.replace(node, intrinsics=lens) if node.name == camera else node for node in rig.nodes)
    record = rig.calibration
    if record is not None:
        record = msgspec.structs.replace(record, method="outdated", error_m=None)
    return msgspec.structs.replace(rig, nodes=nodes, calibration=record)


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationAccuracy:
    """What a rig's calibration adds to the uncertainty of positions.

    `sd_m` is the standard deviation at `distance_m` from the middle of the cameras, at `centres` (C, 3) m in
    the rig frame. It is NaN when it is unknown; `reason` then says why in a sentence. `turned_m`: standard deviation
    there, along the lines of sight, by turns that the cameras were found to have.
    """

    sd_m: float
    distance_m: float
    centres: Array
    reason: str = ""
    turned_m: float = 0.0

    @property
    def known(self) -> bool:
        """Whether the standard deviation is known."""
        return not self.reason

    def at(self, positions: Array) -> Array:
        """Standard deviations (...,) m at positions (..., 3) m of the rig frame.

        They grow with the square of the distance to the cameras, as stereo's error of depth does: dz = z^2 / (B f) dx.
        """
        return self.sd_m * self._square_ratio(np.asarray(positions))

    def covariances(self, positions: Array) -> Array:
        """Covariances (..., 3, 3) m^2 at positions (..., 3) m: a third of the variance along each axis, and along the
        lines of sight all of it, or that of the turns if it is more. What is not known counts as nothing."""
        positions = np.asarray(positions)
        away = positions[..., None, :] - self.centres
        along = away / np.maximum(np.linalg.norm(away, axis=-1, keepdims=True), np.finfo(float).tiny)
        outer = np.einsum("...ci,...cj->...ij", along, along) / len(self.centres)
        stated = 0.0 if self.reason else self.sd_m**2
        more = max(stated, self.turned_m**2) - stated / 3.0
        return np.asarray(np.square(self._square_ratio(positions))[..., None, None]
                          * (stated / 3.0 * np.eye(3) + more * outer))

    def with_turns(self, turns: Array, reference: int) -> CalibrationAccuracy:
        """With what C cameras add that are turned by `turns` (C,) rad, rms about an axis, against `reference`, if it
        is more than before. 0: not tracked with. Cameras far apart show a distance better, and count more."""
        others = np.flatnonzero((np.arange(len(turns)) != reference) & (turns > 0.0))
        apart = np.linalg.norm(self.centres[others] - self.centres[reference], axis=1)
        base = np.minimum(apart, self.distance_m)  # as in `turn`
        if not base.any():
            return self
        turned_m = self.distance_m**2 / float(np.sqrt(np.mean(np.square(base / turns[others]))))
        return replace(self, turned_m=max(turned_m, self.turned_m))

    def turn(self, base_m: Array) -> Array:
        """Standard deviations (...,) rad of a turn between cameras `base_m` (...,) m apart that by itself makes this
        error: dz = z^2 / B dphi, of cameras further apart than the distance dz = z dphi."""
        return np.asarray(self.sd_m * np.minimum(base_m, self.distance_m) / self.distance_m**2)

    def _square_ratio(self, positions: Array) -> Array:
        """(...,) the mean square of the distances to the cameras, of that where `sd_m` is."""
        middle = self.centres.mean(axis=0)
        spread = np.square(self.centres - middle).sum(axis=1).mean()
        return np.asarray((np.square(positions - middle).sum(axis=-1) + spread) / (self.distance_m**2 + spread))


KNOWN_EXACTLY = CalibrationAccuracy(0.0, 1.0, np.zeros((1, 3)))


def calibration_error(rig: Rig | None) -> CalibrationAccuracy:
    """What the calibration of `rig` adds. Nothing in disparity mode, whose covariances include it (docs/rig.md)."""
    if rig is None or rig.depth.mode == "disparity":
        return KNOWN_EXACTLY
    found, record = calibration_finding(rig), rig.calibration
    if found is not None and found.finding.figure == NOT_CALIBRATED:
        return _unknown(rig, "Nobody knows how far places are off: the cameras are not calibrated.")
    if record is not None and record.method == "exact":
        return CalibrationAccuracy(0.0, 1.0, _centres(rig))
    if record is None or record.error_m is None:
        return _unknown(rig, "Nobody knows how far places are off: the rig file does not say how well its cameras were "
                        "calibrated. Repeat the stereo calibration (Calibrate menu) to know it.")
    return CalibrationAccuracy(record.error_m, record.distance_m, _centres(rig))


def _unknown(rig: Rig, reason: str) -> CalibrationAccuracy:
    return CalibrationAccuracy(float("nan"), 1.0, _centres(rig), reason)


def _centres(rig: Rig) -> Array:
    return np.array([node.pose.translation_m for node in rig.nodes])


def _poses_nominal(rig: Rig) -> bool:
    """Whether two or more cameras all have the identity for their rotation."""
    return len(rig.nodes) > 1 and all(np.abs(node.pose.rotation_wxyz[1:]).max() < _NO_TURN for node in rig.nodes)
