"""Fiducial tags on objects."""

from __future__ import annotations

from typing import Any

from rhot_app.objects.observations import FiducialFrame, fiducial_frame
from rhot_app.tracking.kinds.kind import FrameTimes, Kind
from rhot_node.wire.messages import Fiducials


class TagKind(Kind):
    """See `Kind`. Their residual is `objects.motion.PointResidual`."""

    name = "tags"
    messages = (Fiducials,)

    def observe(self, collected: Any, times: FrameTimes) -> FiducialFrame:
        """See `Kind`."""
        return fiducial_frame(collected, self.camera, times.t_row0_ns, times.t_receive_ns)
