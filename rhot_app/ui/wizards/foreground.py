"""The wizard for a bare hand: the nodes learn the empty scene and the skin."""

from __future__ import annotations

import contextlib

from PySide6.QtWidgets import QPushButton

from rhot_app.errors import RhotError
from rhot_app.ui.common.job import Job
from rhot_app.ui.wizards.framework.definition import Definition, WizardContext, accept_page
from rhot_app.ui.wizards.framework.page import Page
from rhot_app.ui.wizards.models.step import StepView
from rhot_app.ui.wizards.steps.foreground_steps import EmptyStep, LearningStep, SkinStep, ask_node, propose


def make_wizard(context: WizardContext) -> Definition:
    """The wizard's pages for the rig at hand."""
    cameras = {node.name: node.node_id for node in context.rig.nodes if node.node_id in context.now.node_settings}
    empty, skin = EmptyStep(cameras), SkinStep(cameras, context.connect)
    last = accept_page(context, lambda: propose(empty, skin), "Learn the empty scene and your hand first.")
    pages = (LearnPage(empty, context, "Learn the empty scene"), LearnPage(skin, context, "Learn my skin"),
             last)

    def put_back() -> None:
        """What was only tried out goes, and what is being learnt is given up."""
        for step in (empty, skin):
            step.stop()
        if last.accept.state != "used" and (empty.tried or skin.tried):
            with contextlib.closing(context.connect()) as asker:
                for node_id in cameras.values():
                    with contextlib.suppress(RhotError):  # a node that is gone has forgotten it anyway
                        ask_node(asker.command, node_id, "revert_foreground")

    return Definition(pages, put_back=put_back)


class LearnPage(Page):
    """A button that has the nodes learn; the pictures stay live."""

    def __init__(self, step: LearningStep, context: WizardContext, label: str) -> None:
        super().__init__(step)
        self._learning, self._context = step, context
        self._job: Job | None = None
        self.learn_button = QPushButton(label)
        self.learn_button.setAutoDefault(False)
        self.learn_button.setToolTip("Tried out at once by every node, and kept by none before the last step.")
        self.learn_button.clicked.connect(self.learn)
        self.column.addWidget(self.learn_button)
        self.column.addStretch(1)
        self.first_field = self.learn_button

    def learn(self) -> None:
        """Have the nodes learn, in a worker."""
        if self._job is None:
            self._learning.begin()
            self._job = Job(lambda progress: self._ask(), self._learnt, self._failed, None, self).start()
            self.changed.emit()

    def show_view(self, view: StepView) -> None:
        """The button waits for what is under way."""
        self.learn_button.setEnabled(self._job is None and bool(self._learning.nodes))

    def _ask(self) -> str:
        with contextlib.closing(self._context.connect()) as asker:
            return self._learning.learn(asker.command)

    def _learnt(self, problem: str) -> None:
        self._job = None
        self._learning.finish(problem)
        self.changed.emit()

    def _failed(self, sentence: str) -> None:
        self._job = None
        self._learning.finish(sentence, learnt=False)
        self.changed.emit()
