"""The window on a rig whose cameras run: their pictures through the engine, the tracked pose, the hand into the rig."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
from PySide6.QtWidgets import QWidget

from rhot_app.hand.anatomy import HandAnatomy
from rhot_app.hand.skeleton import HandPose
from rhot_app.handfit.session import HandFit
from rhot_app.ui.backend.contract import Connect, Listener
from rhot_app.ui.backend.feed import LiveFeed, StateFeed
from rhot_app.ui.handfit.frame import Kept
from rhot_app.ui.handfit.instants import LiveCameras
from rhot_app.ui.handfit.window import REASON, HandFitWindow
from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.models.proposal import RigChange
from rhot_app.ui.wizards.framework.definition import SettingsStore

RECENT_S = 0.5
"""s: a pose that was tracked so lately is where a hand held still is now."""


def fit_live(fit: HandFit, path: Path | None, connect: Connect, listen: Callable[[], Listener],
             scheme: Scheme, memory: SettingsStore, parent: QWidget | None) -> HandFitWindow:
    """The window of `fit` on the engine's rig, whose file is at `path`; None: it came from no file."""
    nodes = [node for node in fit.rig.nodes if not node.text_datagrams]
    feed, states = LiveFeed({node.name: node.node_id for node in nodes}, connect), StateFeed(listen)
    states.start()

    def pose() -> HandPose | None:
        """The pose tracked last, unless nothing is."""
        tracked = [one for one in states.recent(RECENT_S) if np.isfinite(one.angles).all()
                   and np.isfinite(one.world_from_palm).all() and one.tracked]
        return HandPose(tracked[-1].world_from_palm, tracked[-1].angles) if tracked else None

    def use(hand: HandAnatomy) -> None:
        """The hand into the engine's rig and its file, which keeps what it had."""
        with contextlib.closing(connect()) as client:
            RigChange(fit.rig, msgspec.structs.replace(fit.rig, hand=hand), path, REASON).use(client.command)
        fit.rig = msgspec.structs.replace(fit.rig, hand=hand)

    def stop() -> None:
        feed.stop()
        states.stop()

    numbers = {node.name: fit.names.index(node.name) for node in nodes}
    return HandFitWindow(fit, scheme, memory, Kept(use), LiveCameras(feed, pose, numbers, stop), parent)
