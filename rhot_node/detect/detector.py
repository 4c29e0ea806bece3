"""What every detector offers: one image in, the candidates of every marker of its set out."""

from __future__ import annotations

from typing import Protocol

from rhot_node.detect.image import YuvImage
from rhot_node.wire.messages import MarkerObservation


class Detector(Protocol):
    """A detector keeps small state between frames (windows, sizes); frames must come in order of time."""

    def detect(self, image: YuvImage) -> tuple[MarkerObservation, ...]:
        """The best candidate of every marker, in the order of the marker set, lost markers reported as lost; then
        further candidates, if any: at most CANDIDATES_MAX of a marker in all."""
        ...

    def reset(self) -> None:
        """Forget all tracks: the next frame is searched as a whole."""
        ...
