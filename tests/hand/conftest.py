"""The two shipped hands."""

from __future__ import annotations

import pytest

from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.model import build_model
from rhot_node.files import resource_path


@pytest.fixture(scope="session")
def right_hand():
    return build_model(load_hand(resource_path("hands", "right.json")))


@pytest.fixture(scope="session")
def left_hand():
    return build_model(load_hand(resource_path("hands", "left.json")))
