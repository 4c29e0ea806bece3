"""The filter wizard: hold still, move fast, look at what filters would do, use them (RHOT 7.3)."""

from __future__ import annotations

from rhot_app.ui.wizards.accept_page import AcceptPage
from rhot_app.ui.wizards.filter_page import MeterPage, TunePage
from rhot_app.ui.wizards.models.accept import AcceptStep
from rhot_app.ui.wizards.models.filter_meters import FastCoach, LiveMeters, StillCoach
from rhot_app.ui.wizards.models.filter_steps import FAST_S, STILL_S, TuneStep, propose
from rhot_app.ui.wizards.movement_kit import Movements
from rhot_app.ui.wizards.plan import Kit, Plan


def make_plan(kit: Kit) -> Plan:
    """Hold still, move fast, look at the charts, use it."""
    movements, meters = Movements(kit), LiveMeters()

    def page(title: str, sentence: str, seconds: float, coach: type[StillCoach] | type[FastCoach]) -> MeterPage:
        return movements.page_of(lambda step, connect, states: MeterPage(step, connect, states, meters),
                                 title, sentence, seconds, lambda: coach(meters))

    still = page("Hold still", "Rest the hand before both cameras, then press Record.", STILL_S, StillCoach)
    fast = page("Move fast", "Press Record, then wave the hand briskly, 20 cm wide.", FAST_S, FastCoach)
    tune = TuneStep(lambda: (still.movement.log, fast.movement.log), kit.rig)
    accept = AcceptStep(lambda: propose(tune.report, kit.rig, kit.rig_path, per_marker=tune.per_marker),
                        "Record both movements first.")
    return Plan("Filters", (still, fast, TunePage(tune, kit.scheme), AcceptPage(accept, kit.scheme)),
                solver="rhot_app.calibration.filter_tuning", put_back=movements.end)
