"""The stereo solve as the solving process runs it: lenses that nobody has calibrated come from the same views."""

from __future__ import annotations

from collections.abc import Sequence

from rhot_app.calibration.lens.search import find_lens
from rhot_app.calibration.lens.start import LensStart
from rhot_app.calibration.stereo.calibrate import KnownLengths, calibrate
from rhot_app.calibration.stereo.report import StereoReport
from rhot_app.calibration.stereo.rig import lens_of
from rhot_app.calibration.stereo.views import SharedViews
from rhot_app.progress import Progress
from rhot_app.project import RigNode


def put_together(views: SharedViews, lenses: Sequence[LensStart | None], *, known: KnownLengths,
                 progress: Progress) -> StereoReport:
    """`lenses` one per camera, None to find it from the views. Raises CalibrationError."""
    found = [lens if lens is not None else find_lens(views.of_camera(camera), views.board, views.cameras[camera])
             for camera, lens in enumerate(lenses)]
    return calibrate(views, found, known=known, remembered=lenses, progress=progress)


def known_lenses(nodes: Sequence[RigNode]) -> list[LensStart | None]:
    """The rig's lenses, None for those that only say what is written on the box."""
    return [None if node.intrinsics.nominal else lens_of(node) for node in nodes]
