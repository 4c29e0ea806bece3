"""How long a node's datagrams take to arrive: a jump shows that its clock was set, before the next clock exchange can.

Between two exchanges, a clock that was set makes all datagrams look as if they had taken longer, or less than no time.
So does a network that is suddenly slow. The next exchange, which is hurried, tells one from the other; what comes
before it is not believed, for a state with a wrong time is worse than none.
"""

from __future__ import annotations

from rhot_app.sources.clock import ClockEstimate

SLACK_NS = 1_000_000
"""Scheduling at both ends: so much more, or less, than the longest and the shortest way so far is no jump."""

FORGETTING = 1e-4
"""Per datagram: the range narrows to what the network does now, in a minute or two; a busy machine is not doubted anew
at every hiccup."""


class TravelTimes:
    """The range of one node's travel times that exchanges have confirmed. One thread."""

    def __init__(self) -> None:
        self._shortest_ns = self._longest_ns = 0.0
        self._known = False
        self._doubt_since_ns: int | None = None

    @property
    def in_doubt(self) -> bool:
        """Whether the last datagram was not believed."""
        return self._doubt_since_ns is not None

    def believed(self, travel_ns: int, t_receive_ns: int, estimate: ClockEstimate) -> bool:
        """Whether a datagram's times can be believed that took `travel_ns` by the clock `estimate`."""
        if self._known:
            slack_ns = SLACK_NS + 1e9 * estimate.bound_s(t_receive_ns)
            if not self._shortest_ns - slack_ns <= travel_ns <= self._longest_ns + slack_ns:
                if self._doubt_since_ns is None:
                    self._doubt_since_ns = t_receive_ns
                if estimate.t_master_ns <= self._doubt_since_ns:
                    return False
            self._shortest_ns += FORGETTING * (travel_ns - self._shortest_ns)
            self._longest_ns += FORGETTING * (travel_ns - self._longest_ns)
        else:
            self._shortest_ns = self._longest_ns = travel_ns
            self._known = True
        self._doubt_since_ns = None
        self._shortest_ns = min(self._shortest_ns, travel_ns)
        self._longest_ns = max(self._longest_ns, travel_ns)
        return True
