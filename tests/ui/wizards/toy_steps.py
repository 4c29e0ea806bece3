"""A toy calibration by the recipe of `rhot_app.ui.wizards`, first part: its record, step, work and proposal."""

from __future__ import annotations

import msgspec

from rhot_app.calibration.registry import Calibration
from rhot_app.calibration.verdict import Verdict, judge
from rhot_app.ui.models.proposal import Proposal, RigChange, Row
from rhot_app.ui.wizards.models.step import Bar, Step, StepView

TOY = Calibration("toy", "Toy", "How bright the pictures are.", "toy calibration")
ENOUGH = 3


class GreyStep(Step):
    """How bright the pictures are, three times."""

    title = "Take pictures"
    watches = captures = True

    def __init__(self):
        self.now = None
        self.levels = ()

    def see(self, pictures):
        return float(sum(picture.bgr.mean() for picture in pictures.values()) / len(pictures))

    def take(self, seen):
        self.now = seen

    def capture(self):
        self.levels += () if self.now is None else (self.now,)
        return self.now is not None

    @property
    def keeps(self):
        return bool(self.levels)

    def view(self):
        count = len(self.levels)
        return StepView("Press Space.", done=count >= ENOUGH, bars=(Bar("pictures", count / ENOUGH),), kept=count)


def mean_level(levels, *, progress):
    """The work of the solver's process."""
    progress("averaging", 1.0)
    return sum(levels) / len(levels)


def verdict_of(level) -> Verdict:
    """On a mean grey level."""
    return judge(f"grey level {level:.0f}", [])


def propose(level, context):
    """The level as the rig's name."""
    if level is None:
        return None
    after = msgspec.structs.replace(context.rig, name=f"grey {level:.0f}")
    return Proposal(TOY.reason, verdict_of(level), (Row("name", context.rig.name, after.name),),
                    (RigChange(context.rig, after, context.rig_path, TOY.reason),))
