"""The wizard that finds a camera's lens: camera and board, views, solve, before and after."""

from __future__ import annotations

from rhot_app.ui.wizards.accept_page import AcceptPage
from rhot_app.ui.wizards.board_page import MEMORY
from rhot_app.ui.wizards.lens_page import LensBoardPage, LensResultPage
from rhot_app.ui.wizards.models.accept import AcceptStep
from rhot_app.ui.wizards.models.board_form import fields_from
from rhot_app.ui.wizards.models.lens_result import LensSolveStep, lens_proposal
from rhot_app.ui.wizards.models.lens_steps import LensBoardStep, LensShowStep
from rhot_app.ui.wizards.models.proposal import Proposal
from rhot_app.ui.wizards.models.stereo_proposal import chosen_nodes
from rhot_app.ui.wizards.page import Page
from rhot_app.ui.wizards.plan import Kit, Plan

LAST = "lens camera"


def make_plan(kit: Kit) -> Plan:
    """The wizard's pages for the rig at hand; it begins with the camera after the one that was done last."""
    cameras = tuple(node.name for node in chosen_nodes(kit.rig))
    board = LensBoardStep(fields_from(kit.memory.remembered(MEMORY)), cameras,
                          _next(cameras, kit.memory.remembered(LAST)))
    show = LensShowStep(board)
    solve = LensSolveStep(show)

    def propose() -> Proposal | None:
        if solve.report is None:
            return None
        kit.memory.remember(LAST, board.camera)
        return lens_proposal(kit.rig, kit.rig_path, board.camera, solve.report)

    pages = (LensBoardPage(board, kit.memory), Page(show), LensResultPage(solve),
             AcceptPage(AcceptStep(propose), kit.scheme))
    return Plan("Find the lens of a camera", pages, solver="rhot_app.calibration.intrinsics")


def _next(cameras: tuple[str, ...], done: str) -> str:
    return cameras[(cameras.index(done) + 1) % len(cameras)] if done in cameras else cameras[0]
