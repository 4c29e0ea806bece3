"""The hands and the rig that RHOT ships, for the tests that start from them."""

from __future__ import annotations

import pytest

from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.model import HandModel, build_model
from rhot_app.project import load_rig
from rhot_node.files import resource_path

RIGHT_HAND, LEFT_HAND = (load_hand(resource_path("hands", f"{side}.json")) for side in ("right", "left"))
RIGHT_MODEL, LEFT_MODEL = build_model(RIGHT_HAND), build_model(LEFT_HAND)
TWO_PIS = load_rig(resource_path("rigs", "two_pis.json"))


@pytest.fixture(params=[RIGHT_MODEL, LEFT_MODEL], ids=["right", "left"])
def model(request: pytest.FixtureRequest) -> HandModel:
    return request.param
