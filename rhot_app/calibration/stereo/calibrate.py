"""The stereo calibration as a whole: shared views of two or more cameras in, a result with its verdict out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import msgspec
import numpy as np
from numpy.typing import NDArray

from rhot_app.calibration.board.poses import PosedView, pose_view
from rhot_app.calibration.board.shared_views import Dropped, SharedViews
from rhot_app.calibration.check.camera_calibration import lengths_finding
from rhot_app.calibration.check.checks import check_cameras
from rhot_app.calibration.lens.fit import LensStart
from rhot_app.calibration.lens.intrinsics_checks import WORKING_DISTANCE_M
from rhot_app.calibration.stereo.adjust import FEWEST_SHOTS, StereoSolution, adjust_rig
from rhot_app.calibration.stereo.checks import arrangement_findings, dropped_findings, fit_findings
from rhot_app.calibration.stereo.diagnosis import Doubtful, explain, explain_shot
from rhot_app.calibration.stereo.points import LensEvidence, lens_evidence, mismatch_finding
from rhot_app.calibration.stereo.result import StereoFigures, StereoResult, figures_of
from rhot_app.calibration.stereo.ruler import RulerReading, baseline_finding, read_ruler, ruler_finding
from rhot_app.calibration.stereo.start import Link, PlacedShot, WorldFrame, all_links, place_shot, spanning_tree
from rhot_app.calibration.verdict import Finding, Grade, Verdict, judge
from rhot_app.errors import CalibrationError
from rhot_app.estimation.se3 import quaternion_from_rotation, rotation_from_quaternion
from rhot_app.geometry.camera import lens_parameters, rig_intrinsics
from rhot_app.geometry.transforms import inverse, rigid
from rhot_app.progress import Progress, silent
from rhot_app.project import CameraCalibration, CameraPose, Rig, RigNode

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class KnownLengths:
    """What else is known about sizes: the distance in m between the first two cameras, measured by hand, and a ruler
    that the cameras saw."""

    baseline_m: float | None = None
    ruler: RulerReading | None = None

    @property
    def which(self) -> Literal["skipped", "baseline", "ruler"]:
        """The better one of those that are there."""
        return "ruler" if self.ruler is not None else "skipped" if self.baseline_m is None else "baseline"


def calibrate(views: SharedViews, lenses: Sequence[LensStart], *, refine: bool = False,
              known: KnownLengths | None = None, remembered: Sequence[LensStart | None] = (),
              dropped: Sequence[Dropped] = (), noticed: Sequence[Finding] = (),
              progress: Progress = silent) -> StereoResult:
    """Put the cameras of `views` together.

    `lenses` one per camera; `refine` lets given ones change within their standard deviations. `remembered` lenses of an
    earlier calibration of the same cameras: nothing is computed from them, but they know mirrored and swapped
    pictures. `dropped` pictures that were already left out when the files were read, and what was `noticed`
    in them. Raises CalibrationError when there is nothing to calibrate from: too few shared shots, a lens for another
    picture size.
    """
    _check_sizes(views, lenses)
    known = known or KnownLengths()
    outcome = solve(views, lenses, refine=refine, progress=progress)
    noticed = [*noticed, *(lens.trouble for lens in lenses if lens.trouble is not None)]
    if isinstance(outcome, Finding):
        summary = f"{' and '.join(views.cameras)} cannot be calibrated together."
        return StereoResult(views.cameras, None, tuple(dropped), summary, judge(summary, [*noticed, outcome]))
    progress("measuring what came out", 0.97)
    figures = figures_of(outcome, lenses, [shot.name for shot in views.shots])
    ruler = None if known.ruler is None else read_ruler(known.ruler, figures.state)
    confirmed = known if ruler is None or ruler.tells else replace(known, ruler=None)
    figures = replace(figures, ruler=ruler, lengths=confirmed.which)
    every = (*dropped, *outcome.dropped)
    evidence = lens_evidence(outcome, [own if own.origin == "given" else before for own, before
                                       in zip(lenses, remembered or [None] * len(lenses), strict=True)])
    findings = [*noticed, *_findings(figures, outcome, lenses, known, evidence, every)]
    progress("stereo calibration", 1.0)
    summary = _summary(figures)
    return StereoResult(views.cameras, figures, every, summary, judge(summary, findings))


def _check_sizes(views: SharedViews, lenses: Sequence[LensStart]) -> None:
    for camera, (name, lens) in enumerate(zip(views.cameras, lenses, strict=True)):
        for view in views.of_camera(camera):
            if view.size != lens.size:
                raise CalibrationError(
                    f"{name}: {view.source or 'a picture'} is {view.width}x{view.height} px, the intrinsics are for "
                    f"{lens.size[0]}x{lens.size[1]}. Take the pictures in the size that the tracking uses, and "
                    "calibrate the intrinsics in the same one.")


def _findings(figures: StereoFigures, solution: StereoSolution, lenses: Sequence[LensStart], known: KnownLengths,
              evidence: LensEvidence, dropped: Sequence[Dropped]) -> list[Finding]:
    found = arrangement_findings(figures, evidence)
    if not found:  # a mirrored or another camera's lens fits badly, too; one reason is enough
        mismatch = mismatch_finding(solution, lenses)
        found += [mismatch] if mismatch is not None else []
    found += fit_findings(figures, lenses_from_views=any(lens.origin == "views" for lens in lenses))
    found += dropped_findings(dropped, len(figures.shots))
    square = figures.board.square_m
    if figures.ruler is not None:
        found.append(ruler_finding(figures.ruler, square, figures.board.parts))
    if known.baseline_m is not None:
        pair = figures.pairs[0]
        found.append(baseline_finding(pair.baseline_m, known.baseline_m, square, (pair.first, pair.second),
                                      figures.board.parts))
    return found if figures.lengths != "skipped" else [*found, lengths_finding()]


def _summary(figures: StereoFigures) -> str:
    baselines = ", ".join(f"{pair.first} to {pair.second} {pair.baseline_m * 1e3:.1f} mm" for pair in figures.pairs)
    return (f"rms {figures.rms_px:.2f} px over {len(figures.shots)} shots; {baselines}; "
            f"{figures.board.parts} "
            f"{figures.squares.mean_m * 1e3:.2f} mm.")


# -- putting cameras together ------------------------------------------------------------------------------------------

def solve(views: SharedViews, lenses: Sequence[LensStart], *, refine: bool = False,
          progress: Progress = silent) -> StereoSolution | Finding:
    """All cameras in the first one's frame; or the finding that says why they cannot be calibrated together.

    `lenses` one per camera; `refine` lets given ones change within their standard deviations. Raises CalibrationError
    when cameras share no shot, or too few.
    """
    _check(views)
    progress("finding the board in space", 0.0)
    posed = [[None if view is None else pose_view(view, views.board, lens.lens)
              for view, lens in zip(shot.views, lenses, strict=True)] for shot in views.shots]
    links = all_links(posed, len(views.cameras))
    placed, tree = spanning_tree(links, len(views.cameras))
    if len(placed) < len(views.cameras):
        return _why_apart(views, lenses, posed, links, placed)
    boards, dropped = _place_boards(views, lenses, posed, tree, placed)
    start = np.array([placed[camera] for camera in range(len(views.cameras))])
    return adjust_rig(views, lenses, posed, start, boards, dropped, refine=refine, progress=progress)


def _check(views: SharedViews) -> None:
    shared = [shot for shot in views.shots if len(shot.seen_by) >= 2]
    lonely = [name for camera, name in enumerate(views.cameras)
              if not any(shot.views[camera] is not None for shot in shared)]
    if lonely:
        raise CalibrationError(f"{' and '.join(lonely)}: no picture shows the board at the same moment as another "
                               "camera. Hold the board where at least two cameras see it whole.")
    if len(shared) < FEWEST_SHOTS:
        raise CalibrationError(f"Only {len(shared)} shots show the board in two cameras; {FEWEST_SHOTS} are the least, "
                               "15 are good.")


def _why_apart(views: SharedViews, lenses: Sequence[LensStart], posed: Sequence[Sequence[PosedView | None]],
               links: Sequence[Link], placed: dict[int, Array]) -> Finding:
    """Why some camera hangs together with no other: the pair that shares most is looked into."""
    between = [each for each in links if (each.first in placed) != (each.second in placed)]
    if not between:
        apart = [name for camera, name in enumerate(views.cameras) if camera not in placed]
        raise CalibrationError(f"{' and '.join(apart)}: no shot is shared with the group of {views.cameras[0]}. Take "
                               "pictures that show the board to a camera of either group at the same moment.")
    worst = max(between, key=lambda each: each.shared)
    return explain(_doubt(views, lenses, posed, worst), worst)


def _doubt(views: SharedViews, lenses: Sequence[LensStart], posed: Sequence[Sequence[PosedView | None]],
           each: Link) -> Doubtful:
    a, b = each.first, each.second
    return Doubtful((views.cameras[a], views.cameras[b]), (lenses[a], lenses[b]),
                    ([shot[a] for shot in posed], [shot[b] for shot in posed]),
                    [shot.name for shot in views.shots], views.board)


def _place_boards(views: SharedViews, lenses: Sequence[LensStart], posed: Sequence[Sequence[PosedView | None]],
                  tree: Sequence[Link], placed: dict[int, Array]) -> tuple[list[PlacedShot], list[Dropped]]:
    """The boards that at least two cameras agree on, and the shots that were dropped."""
    boards, dropped = [], []
    for shot, those in enumerate(posed):
        board = place_shot(shot, those, placed)
        if board is not None and len(board.agreeing) >= 2:
            boards.append(board)
            dropped += [Dropped(f"{views.shots[shot].name} of {views.cameras[camera]}",
                                "the other cameras agree that the board is elsewhere", "apart")
                        for camera in board.disagreeing]
        elif board is not None and board.disagreeing:
            guilty = next((each for each in tree if shot in each.disagreeing), tree[0])
            dropped.append(explain_shot(_doubt(views, lenses, posed, guilty), shot, guilty.second_from_first))
    return boards, dropped


# -- the calibrated rig ------------------------------------------------------------------------------------------------

ARRANGED = frozenset({"swapped", "swapped_or_mirrored", "mirrored"})
"""Findings that say why right stands on the left: the first of them is enough."""


def require_nodes(rig: Rig, cameras: Sequence[str]) -> None:
    """Raise CalibrationError unless the rig has a node of every camera's name."""
    known = [node.name for node in rig.nodes]
    missing = [name for name in cameras if name not in known]
    if missing:
        raise CalibrationError(f"the rig \"{rig.name}\" has no camera called {' or '.join(missing)}; it has "
                               f"{', '.join(known)}. Name the cameras as the rig does, with --camera NAME=PATTERN.")


def lens_of(node: RigNode) -> LensStart:
    """The lens that a rig states for a node."""
    return LensStart(lens_parameters(node.intrinsics), (node.intrinsics.width, node.intrinsics.height))


def calibrated_rig(rig: Rig, figures: StereoFigures, frame: WorldFrame | None = None) -> Rig:
    """`rig` with the lenses and places of the calibrated cameras, in the table's `frame` where one was placed.

    Cameras that were not calibrated keep their lens and their place relative to the first calibrated one, if both were
    known. Raises CalibrationError when a camera is not in the rig.
    """
    names = [camera.name for camera in figures.cameras]
    require_nodes(rig, names)
    poses = figures.world_from_camera if frame is None else frame.world_from_camera
    old = next(node for node in rig.nodes if node.name == names[0])
    new_from_old = poses[0] @ inverse(_matrix(old.pose))
    nodes = []
    for node in rig.nodes:
        if node.name in names:
            camera = figures.cameras[names.index(node.name)]
            lens = rig_intrinsics(camera.size, camera.lens)
            nodes.append(msgspec.structs.replace(node, intrinsics=lens, pose=_pose(poses[names.index(node.name)]),
                                                 pose_known=True))
        else:
            nodes.append(msgspec.structs.replace(node, pose=_pose(new_from_old @ _matrix(node.pose)),
                                                 pose_known=node.pose_known and old.pose_known))
    up: Literal["-y", "z"] = "-y" if frame is None else "z"
    error_m = figures.error_m[0]
    record = CameraCalibration("board", figures.lengths, error_m if np.isfinite(error_m) else None, WORKING_DISTANCE_M)
    return msgspec.structs.replace(rig, nodes=tuple(nodes), up=up, calibration=record,
                                   depth=msgspec.structs.replace(rig.depth, mode="stereo"))


def rig_findings(rig: Rig, cameras: Sequence[str]) -> list[Finding]:
    """What a rig with new cameras is blamed for by its own checks, and which cameras were not calibrated with them."""
    found = [finding for finding in check_cameras(rig) if finding.grade is not Grade.GOOD]
    left_out = [node.name for node in rig.nodes if node.name not in cameras]
    if left_out:
        found.append(Finding("not_calibrated", Grade.FAIR, f"{' and '.join(left_out)} of the rig took no part.",
                             "They keep their lenses, and stand to the first camera as they did before.",
                             "Calibrate all cameras together."))
    return found


def rig_verdict(result: StereoResult, rig: Rig, frame: WorldFrame | None = None) -> Verdict:
    """The verdict on writing `rig`: the calibration's, the rig's own checks, and the world frame's; each thing once."""
    found = list(result.verdict.findings)
    named = result.verdict.codes & ARRANGED
    found += [each for each in rig_findings(rig, result.cameras) if not (named and each.code in ARRANGED)]
    found += frame.verdict.findings if frame is not None else ()
    return judge(result.summary, list({finding.figure: finding for finding in found}.values()))


def _matrix(pose: CameraPose) -> Array:
    return rigid(rotation_from_quaternion(pose.rotation_wxyz), pose.translation_m)


def _pose(world_from_camera: Array) -> CameraPose:
    w, x, y, z = (float(value) for value in quaternion_from_rotation(world_from_camera[:3, :3]))
    tx, ty, tz = (float(value) for value in world_from_camera[:3, 3])
    return CameraPose((w, x, y, z), (tx, ty, tz))
