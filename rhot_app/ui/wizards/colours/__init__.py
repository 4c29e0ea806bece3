"""The colour wizard: pick every marker's paint, look at the mask, see what may be mistaken for it, use it."""

from __future__ import annotations

from dataclasses import replace

from rhot_app.calibration.colour.colours import ColourResult
from rhot_app.ui.language import tr
from rhot_app.ui.wizards.colours.bounds import BoundsPage, BoundsStep
from rhot_app.ui.wizards.colours.pick import PickPage, PickStep
from rhot_app.ui.wizards.colours.separation import SeparationPage, SeparationStep
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_result


def make_wizard(context: WizardContext) -> Definition:
    """The wizard's pages for the rig at hand."""
    cameras = tuple(node.name for node in context.rig.nodes if not node.text_datagrams)
    picks = PickStep(context.rig.markers, cameras)
    bounds = BoundsStep(context.calibration, context.now, picks)
    apart = SeparationStep(context.calibration, context.now, bounds)

    def judged_now(result: ColourResult) -> ColourResult:
        """With what the light says since then."""
        assert apart.report is not None
        return replace(result, verdict=apart.report.verdict)

    accept = accept_result(context, apart, tr("Pick the markers' colours first."), judged_now)
    pages = (PickPage(picks, context.scheme), BoundsPage(bounds, context.scheme), SeparationPage(apart, context.scheme),
             accept)
    return Definition(pages)
