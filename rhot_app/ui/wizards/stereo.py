"""The wizard that puts two or more cameras together: board, shared captures, a known length, solve, table."""

from __future__ import annotations

from rhot_app.ui.wizards.accept_page import AcceptPage
from rhot_app.ui.wizards.board_page import MEMORY, BoardPage
from rhot_app.ui.wizards.known_page import KnownPage
from rhot_app.ui.wizards.models.accept import AcceptStep
from rhot_app.ui.wizards.models.board_form import BoardStep, fields_from
from rhot_app.ui.wizards.models.known_step import KnownStep
from rhot_app.ui.wizards.models.proposal import Proposal
from rhot_app.ui.wizards.models.stereo_proposal import chosen_nodes, stereo_proposal
from rhot_app.ui.wizards.models.stereo_steps import ShowStep, SolveStep, TableStep
from rhot_app.ui.wizards.models.stereo_work import known_lenses
from rhot_app.ui.wizards.page import Page
from rhot_app.ui.wizards.plan import Kit, Plan


def make_plan(kit: Kit) -> Plan:
    """The wizard's pages for the rig at hand."""
    nodes = chosen_nodes(kit.rig)
    cameras = tuple(node.name for node in nodes)
    board = BoardStep(fields_from(kit.memory.remembered(MEMORY)), cameras)
    show = ShowStep(board, cameras)
    known = KnownStep(cameras)
    solve = SolveStep(show, known_lenses(nodes), lambda: known.known)
    table = TableStep(board, solve, cameras)

    def propose() -> Proposal | None:
        return stereo_proposal(kit.rig, kit.rig_path, solve.report, table.world) if solve.report is not None else None

    accept = AcceptPage(AcceptStep(propose), kit.scheme)
    return Plan("Put the cameras together", (BoardPage(board, kit.memory), Page(show), KnownPage(known), Page(solve),
                                             Page(table), accept), solver="rhot_app.ui.wizards.models.stereo_work")
