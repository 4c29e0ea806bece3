"""The wizard for what the cameras are told: exposure, gains, white balance, contrast, saturation, brightness."""

from __future__ import annotations

from rhot_app.ui.wizards.accept_page import AcceptPage
from rhot_app.ui.wizards.camera_page import CameraPage
from rhot_app.ui.wizards.models.accept import AcceptStep
from rhot_app.ui.wizards.models.camera_settings import CameraChoices
from rhot_app.ui.wizards.models.camera_steps import SettingsStep
from rhot_app.ui.wizards.models.proposal import NodeChange
from rhot_app.ui.wizards.plan import Kit, Plan
from rhot_app.ui.wizards.tryout import Settings, Tryout


def make_plan(kit: Kit) -> Plan:
    """The wizard's pages for the rig at hand."""
    choices = CameraChoices(kit.rig.nodes, kit.node_settings)
    step = SettingsStep(choices, kit.rig.markers)
    tryout = Tryout(kit.connect)
    accept = AcceptStep(lambda: step.propose(kit.rig_path),
                        missing="Nothing was changed, and the pictures are not good yet.")
    page = CameraPage(step, tryout)
    tryout.setParent(page)

    def put_back() -> None:
        """What was only tried out goes; what was saved stays."""
        in_force: dict[int, Settings] = {node.node_id: choices.whole(node.node_id, before=True)
                                         for node in choices.nodes}
        if accept.state == "used" and accept.proposal is not None:
            for change in accept.proposal.changes:
                if isinstance(change, NodeChange):
                    in_force[change.node_id]["camera"].update(change.after["camera"])
        tryout.put_back(in_force)

    return Plan("Set the cameras", (page, AcceptPage(accept, kit.scheme)), put_back=put_back)
