"""A shot as the nodes' own detector sees it: pictures, what is found in them, and what the node sends of it.

Evaluations and the simulated certificate make their raw logs of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rhot_app.project import Rig
from rhot_app.recording.raw_log import Record
from rhot_app.simulator.film.film import Report
from rhot_app.simulator.film.node_log import CABLE, Network, NodeSender
from rhot_app.simulator.film.shot import Shot, make_renderer
from rhot_app.simulator.film.truth import FrameTruth
from rhot_app.simulator.render.painter import PoseSource
from rhot_app.simulator.scene.scene import node_settings
from rhot_node.detect.image import from_i420
from rhot_node.detectors import make_detector
from rhot_node.wire.messages import MarkerObservation

Stream = tuple[list[Record], FrameTruth]
"""What one node says of a shot, and what was true of its frames."""


@dataclass(frozen=True, slots=True)
class Sending:
    """How a node sends: to a rig, over a network; `seed` of the delays, beside the scene's."""

    rig: Rig
    network: Network = CABLE
    seed: int = 0x7A4E

    def said(self, shot: Shot, index: int, seen: Sequence[Sequence[MarkerObservation]]) -> list[Record]:
        """One node's clock exchanges, and a datagram for every frame that is not lost on its way."""
        rng = np.random.default_rng([shot.scene.seed, index, self.seed])
        sender = NodeSender(shot.scene, self.rig, index, rng, self.network)
        times_ns = shot.scene.frame_times_ns(index, shot.seconds)
        sent = [sender.datagram(number, t_ns, markers) for number, (t_ns, markers) in
                enumerate(zip(times_ns, seen, strict=True))]
        return [*sender.exchanges(1e-9 * times_ns[-1]), *(record for record in sent if record is not None)]


def detected(sending: Sending, source: PoseSource | None, shot: Shot, index: int, report: Report) -> Stream:
    """One camera's pictures of the shot, or of another `source` in its place, through the node's detector."""
    scene, preset = shot.scene, shot.scene.preset
    detector, renderer = make_detector(node_settings(scene, index)), make_renderer(shot, index)
    times_ns = scene.frame_times_ns(index, shot.seconds)
    seen, visible = [], []
    for number, t_ns in enumerate(times_ns):
        frame, fractions = renderer.render(source or shot.scene_object.source, 1e-9 * t_ns, number)
        seen.append(detector.detect(from_i420(frame, preset.width, preset.height)))
        visible.append(fractions.copy())
        report(number)
    return sending.said(shot, index, seen), FrameTruth(1e-9 * np.array(times_ns), np.array(visible))
