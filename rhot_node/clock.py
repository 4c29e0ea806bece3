"""The node's clock: monotonic nanoseconds, never the wall clock, so that no time service can make it jump."""

from __future__ import annotations

import time
from dataclasses import dataclass


@dataclass(frozen=True)
class NodeClock:
    """A clock that runs `drift_ppm` fast and stands `offset_ns` ahead of this machine's monotonic clock.

    A real node uses the defaults. Simulated nodes on one machine get clocks that disagree, as real ones do.
    """

    offset_ns: int = 0
    drift_ppm: float = 0.0
    origin_ns: int = 0  # host monotonic time at which the drift began

    def now_ns(self) -> int:
        """Node time now, ns."""
        return self.from_host_ns(time.monotonic_ns())

    def from_host_ns(self, t_host_ns: int) -> int:
        """Node time at which this machine's monotonic clock shows `t_host_ns`."""
        return t_host_ns + self.offset_ns + round((t_host_ns - self.origin_ns) * self.drift_ppm * 1e-6)

    def to_host_ns(self, t_node_ns: int) -> int:
        """Inverse of `from_host_ns`, to the nanosecond rounding."""
        elapsed = (t_node_ns - self.offset_ns - self.origin_ns) / (1.0 + self.drift_ppm * 1e-6)
        return self.origin_ns + round(elapsed)
