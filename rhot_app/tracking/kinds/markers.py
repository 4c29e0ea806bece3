"""Colour markers, and all else that a node's detector reports as markers."""

from __future__ import annotations

from typing import Any

from rhot_app.project import Rig
from rhot_app.tracking.kinds.kind import FrameTimes, Kind
from rhot_app.tracking.tracker import CameraObservations, Candidates
from rhot_node.wire.messages import Observations
from rhot_node.wire.points import MarkerTable


class MarkerKind(Kind):
    """See `Kind`. Their residual is `tracking.markers.marker_residual`."""

    name = "markers"
    messages = (Observations,)

    def configure(self, rig: Rig, camera: int) -> None:
        """See `Kind`."""
        super().configure(rig, camera)
        self._count, self._checksum = len(rig.markers.markers), rig.markers.checksum

    def refusal(self, message: Any) -> str | None:
        """Another marker set."""
        same = (message.marker_checksum, message.marker_count) == (self._checksum, self._count)
        return None if same else "marker_set"

    def observe(self, collected: Any, times: FrameTimes) -> CameraObservations:
        """See `Kind`."""
        message, count = collected, self._count
        assert isinstance(message.markers, MarkerTable)  # as everything that was decoded
        pixels, covariances, diameters, qualities, flags = message.markers.columns()
        further = None
        if len(message.markers) > count:
            further = Candidates(message.markers.indices()[count:], pixels[count:], covariances[count:],
                                 diameters[count:], qualities[count:], flags[count:])
        return CameraObservations(
            camera=self.camera, t_row0_master_ns=times.t_row0_ns, row_time_ns=message.row_time_ns,
            clock_bound_s=times.bound_s, t_receive_ns=times.t_receive_ns,
            detect_s=1e-9 * message.processing_ns, network_s=1e-9 * (times.t_receive_ns - times.t_send_ns),
            pixels=pixels[:count], covariances=covariances[:count], diameters=diameters[:count],
            qualities=qualities[:count], flags=flags[:count], further=further,
            t_row0_node_ns=message.t_frame_node_ns)
