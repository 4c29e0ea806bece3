"""The page of a result: its charts in the middle."""

from __future__ import annotations

from rhot_app.ui.models.palette import Scheme
from rhot_app.ui.wizards.chart_view import ChartView
from rhot_app.ui.wizards.models.chart import ChartedStep
from rhot_app.ui.wizards.models.step import StepView
from rhot_app.ui.wizards.page import Page


class ChartPage(Page):
    """Shows the charts of its step."""

    def __init__(self, step: ChartedStep, scheme: Scheme) -> None:
        super().__init__(step)
        self._charted = step
        self.charts = ChartView(scheme)
        self.centre = self.charts
        self.column.addStretch(1)

    def show_view(self, view: StepView) -> None:
        """The newest charts."""
        self.charts.show_charts(self._charted.charts)
