"""The result of a refinement of the cameras: advice, a verdict, the refined rig, and figures of both."""

from __future__ import annotations

import math
from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.check.health import FAIR_ERROR_PX
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.estimation.se3 import quaternion_from_rotation
from rhot_app.project import CameraCalibration, CameraPose, Rig

Array = NDArray[np.float64]

SIGNIFICANCE = 1e-6
"""Probability of so large a chi-squared while the stored calibration holds: it is tested for hours."""

DETERMINED_RAD, DETERMINED_M = math.radians(0.05), 5e-4
"""Standard deviations beyond which an angle or a shift counts as not determined. A twentieth of a degree about the
vertical makes 4 mm of depth at 0.6 m with a baseline of 75 mm."""

NOTABLE = 3.0
"""Standard deviations from which a turn or a shift is reported."""

MOVE_MORE = ("Move the hand through the whole of both pictures, near and far, for two minutes; or put the cameras "
             "together again with a board.")

_AXES = {"x": "tilted up or down", "y": "turned left or right", "z": "rolled about its line of sight"}


@dataclass(frozen=True, slots=True, eq=False)
class CameraCorrection:
    """One camera against the first. `turn` (3,) rad and `shift` (3,) m along its own axes, with `covariance` (6, 6);
    the shift along the baseline is kept and has no meaning. `along` (3,): the baseline's direction in its axes."""

    name: str
    turn: Array
    shift: Array
    covariance: Array
    along: Array

    @property
    def angle(self) -> tuple[float, float]:
        """The turn and its standard deviation in its own direction, rad; about the axes that are determined, if any is.
        """
        known = self.turn_sd <= DETERMINED_RAD
        known |= not known.any()
        return _length(self.turn[known], self.covariance[:3, :3][np.ix_(known, known)])

    @property
    def offset(self) -> tuple[float, float]:
        """The shift across the baseline and its standard deviation in its own direction, m."""
        across = np.eye(3) - np.outer(self.along, self.along)
        return _length(across @ self.shift, across @ self.covariance[3:, 3:] @ across)

    @property
    def turn_sd(self) -> Array:
        """(3,) rad."""
        return np.asarray(np.sqrt(np.diag(self.covariance)[:3]))

    @property
    def undetermined(self) -> tuple[str, ...]:
        """What the movement did not determine: axes of the turn ("x", "y", "z"), and "baseline" for its direction."""
        names = [name for name, sd in zip(("x", "y", "z"), self.turn_sd, strict=True) if sd > DETERMINED_RAD]
        across = np.eye(3) - np.outer(self.along, self.along)
        worst = math.sqrt(float(np.linalg.eigvalsh(across @ self.covariance[3:, 3:] @ across).max()))
        return (*names, *(["baseline"] if worst > DETERMINED_M else []))


def _length(vector: Array, covariance: Array) -> tuple[float, float]:
    length = float(np.linalg.norm(vector))
    if length < 1e-12:
        return 0.0, math.sqrt(max(float(np.trace(covariance)), 0.0))
    return length, math.sqrt(max(float(vector @ covariance @ vector), 0.0)) / length


@dataclass(frozen=True, slots=True, eq=False)
class Refinement:
    """The refined poses of the cameras by the observations of the last minutes.

    `poses` (C, 4, 4) world_from_camera, refined; `chi_squared`, `freedom` and `probability` test that the stored
    calibration still holds. `knocked_s`: s before the newest observation at which a camera was knocked most probably,
    None for no knock, infinite for one before the first observation. `held_out`: how much better, in log likelihood,
    poses that are refined without some observations since then predict these. `before_px`, `after_px`: rms over cameras
    of the epipolar error, median, of the observations that were held back, px; of all where none could be.
    `moved_m`: by how much the hand's places change, rms; `places_sd_m`: standard deviation of a place by the refined
    poses alone, rms, the scale taken as known.
    `distance_m`: of these places from the cameras' middle, rms.
    `dispersion`: how many times as large as stated the variance of errors is that a marker keeps for seconds.
    `voxels`: places of 5 cm that the markers were in.
    """

    cameras: tuple[CameraCorrection, ...]
    poses: Array
    chi_squared: float
    freedom: int
    probability: float
    knocked_s: float | None
    held_out: float
    before_px: float
    after_px: float
    moved_m: float
    places_sd_m: float
    distance_m: float
    dispersion: float
    observations: int
    voxels: int
    seconds: float

    @property
    def holds(self) -> bool:
        """Whether the stored calibration still holds, as far as is known: another one must be significant, and predict
        what it was not made from."""
        return (self.probability > SIGNIFICANCE or self.held_out < -math.log(SIGNIFICANCE)
                or self.after_px >= self.before_px)


@dataclass(frozen=True, slots=True)
class Scale:
    """How large the hand was with the refined cameras, by its bones: a factor on the lengths in the hand's file, and
    its standard deviation; NaN when unknown."""

    factor: float = math.nan
    sd: float = math.nan

    @property
    def known(self) -> bool:
        """Whether there is one."""
        return math.isfinite(self.factor) and math.isfinite(self.sd)


def _correction_sentence(camera: CameraCorrection, reference: str) -> str:
    """How a camera stands otherwise than the rig says: "The right camera is turned by 0.30 ± 0.02 degrees against the
    left one, compared with the rig"; without a full stop. The rig may never have been calibrated."""
    angle, angle_sd = camera.angle
    offset, offset_sd = camera.offset
    parts = []
    if angle > NOTABLE * angle_sd:
        parts.append(f"turned by {_with_sd(math.degrees(angle), math.degrees(angle_sd))} degrees")
    if offset > NOTABLE * offset_sd:
        parts.append(f"moved by {_with_sd(1e3 * offset, 1e3 * offset_sd)} mm")
    return f"The {camera.name} camera is {' and '.join(parts)} against the {reference} one, compared with the rig"


def _with_sd(value: float, sd: float) -> str:
    """Both with two decimals, or as many as show the standard deviation, four at most."""
    digits = min(max(2, math.ceil(-math.log10(max(sd, 1e-9)))), 4)
    return f"{value:.{digits}f} ± {sd:.{digits}f}"


def stale_sentence(rig: Rig, found: Refinement) -> str:
    """The advice when the stored calibration no longer holds; empty while it does."""
    if found.holds:
        return ""
    what = "; ".join(moved_sentences(found, rig.nodes[0].name))
    if usable(found):
        return f"{what}: use the refined calibration, or calibrate again."
    return f"{what}. The movement does not yet determine all of it. {MOVE_MORE}"


def usable(found: Refinement) -> bool:
    """Whether the refined calibration may be offered."""
    return not found.holds and verdict_of(found, "").acceptable


def verdict_of(found: Refinement, reference: str, scale: Scale = Scale()) -> Verdict:
    """The verdict on using the refined poses. `reference`: the first camera's name."""
    summary = (f"rays miss each other by {found.after_px:.2f} px instead of {found.before_px:.2f} "
               f"(median of {found.observations} observations in {found.voxels} places).")
    findings: list[Finding] = []
    if found.holds:
        why = (f"chi-squared {found.chi_squared:.1f} with {found.freedom} degrees of freedom"
               if found.probability > SIGNIFICANCE else
               "no other one predicts better what was held back from it")
        if found.before_px > FAIR_ERROR_PX:
            findings.append(_misfit(f"The rays miss each other by {found.before_px:.1f} px, and no other poses of the "
                                    f"cameras explain that ({why})."))
        else:
            findings.append(Finding("holds", Grade.GOOD, f"The stored calibration still holds ({why})."))
    else:
        findings += [Finding("moved", Grade.GOOD, f"{sentence}.") for sentence in moved_sentences(found, reference)]
        findings += [finding for camera in found.cameras for finding in _undetermined(camera)]
        if found.after_px > FAIR_ERROR_PX:
            findings.append(_misfit(f"Even so the rays miss each other by {found.after_px:.1f} px."))
    if scale.known:
        findings.append(scale_finding(scale))
    return judge(summary, findings)


def _misfit(figure: str) -> Finding:
    return Finding("misfit", Grade.POOR, figure,
                   "A lens was refocused, a camera is late, or a marker was taken for another thing.",
                   "Calibrate intrinsics and stereo again with a board.")


def scale_finding(scale: Scale) -> Finding:
    """What the bones say of the scale, which is never changed by a refinement."""
    figure = (f"By its bones the hand is {100.0 * (scale.factor - 1.0):+.1f} ± {100.0 * scale.sd:.1f} % larger than "
              "its file says.")
    if abs(scale.factor - 1.0) <= NOTABLE * scale.sd:
        return Finding("scale", Grade.GOOD, figure)
    return Finding("scale", Grade.FAIR, figure, "The cameras' distance has changed, or this is another hand. Rays "
                   "alone cannot tell, so the scale was left as it is.",
                   "Measure the hand, or repeat the stereo calibration with a board.")


def refined_rig(rig: Rig, found: Refinement) -> Rig:
    """The rig with refined poses. What was stated of the error of places now has the refinement's as well."""
    nodes = [rig.nodes[0]]
    for node, pose in zip(rig.nodes[1:], found.poses[1:], strict=True):
        w, x, y, z = (float(value) for value in quaternion_from_rotation(pose[:3, :3]))
        at = (float(pose[0, 3]), float(pose[1, 3]), float(pose[2, 3]))
        nodes.append(msgspec.structs.replace(node, pose=CameraPose((w, x, y, z), at)))
    record = rig.calibration
    if record is not None and record.error_m is not None:
        refined_m = found.places_sd_m * (record.distance_m / found.distance_m) ** 2
        record = CameraCalibration("refined", record.lengths, math.hypot(record.error_m, refined_m), record.distance_m)
    elif record is not None and record.method != "outdated":
        record = msgspec.structs.replace(record, method="refined")
    return msgspec.structs.replace(rig, nodes=tuple(nodes), calibration=record)


def figure_rows(found: Refinement, scale: Scale = Scale()) -> list[tuple[str, str, str]]:
    """(what, before, after) of everything that is not in the rig file."""
    rows = [("rays miss each other by", f"{found.before_px:.2f} px", f"{found.after_px:.2f} px"),
            ("places of markers move by", "–", f"{1e3 * found.moved_m:.1f} mm ± {1e3 * found.places_sd_m:.1f}")]
    for camera in found.cameras:
        for axis, turn, sd in zip(_AXES, camera.turn, camera.turn_sd, strict=True):
            rows.append((f"{camera.name}: {_AXES[axis]}", "0",
                         "not determined" if axis in camera.undetermined else
                         f"{math.degrees(turn):+.3f} ± {math.degrees(sd):.3f} degrees"))
        offset, sd = camera.offset
        rows.append((f"{camera.name}: moved across the baseline", "0",
                     "not determined" if "baseline" in camera.undetermined else
                     f"{1e3 * offset:.2f} ± {1e3 * sd:.2f} mm"))
    rows.append(("scale, by the bones of the hand", "1", "not known" if not scale.known else
                 f"{scale.factor:.3f} ± {scale.sd:.3f}, not applied"))
    return rows


def moved_sentences(found: Refinement, reference: str) -> list[str]:
    """How the cameras stand now against the rig, `reference` is the first one's name; without full stops. A camera is
    named only where its own movement stands out."""
    moved = [camera for camera in found.cameras if camera.angle[0] > NOTABLE * camera.angle[1]
             or camera.offset[0] > NOTABLE * camera.offset[1]]
    return [_correction_sentence(camera, reference) for camera in moved] or [
        "The cameras do not stand to each other as the rig says; which one has moved, and how, is not known"]


def _undetermined(camera: CameraCorrection) -> list[Finding]:
    names = [_AXES.get(name, "moved across the baseline") for name in camera.undetermined]
    if not names:
        return []
    worst = math.degrees(float(camera.turn_sd.max()))
    return [Finding("undetermined", Grade.POOR, f"The movement does not determine how far the {camera.name} camera was "
                    f"{', or '.join(names)} (standard deviation up to {worst:.2f} degrees).",
                    "The hand was in too small a part of the pictures, or always at one distance.", MOVE_MORE)]
