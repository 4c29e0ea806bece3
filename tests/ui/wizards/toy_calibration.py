"""A toy calibration by the recipe of `rhot_app.ui.wizards`, first file: its record, work, report and proposal."""

from __future__ import annotations

import msgspec

from rhot_app.calibration.proposal import proposed
from rhot_app.calibration.registry import Calibration
from rhot_app.calibration.report import Figure, Report
from rhot_app.calibration.verdict import judge

TOY = Calibration("toy", "Toy", "How bright the pictures are.", "toy calibration")


def mean_level(levels, *, progress):
    """The work of the solver's process."""
    progress("averaging", 1.0)
    return sum(levels) / len(levels)


def report(level):
    """The one figure."""
    return Report(judge(f"grey level {level:.0f}", []), (Figure("grey level", level, decimals=0, key="level"),))


def propose(level, rig):
    """The level as the rig's name."""
    return proposed(TOY.reason, report(level), rig, msgspec.structs.replace(rig, name=f"grey {level:.0f}"))
