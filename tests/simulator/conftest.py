"""The programs that this room starts begin as forks. Both hands."""

import pytest
from processes import forked_programs, fresh_programs  # noqa: F401
from shipped_rig import LEFT_MODEL, RIGHT_MODEL

from rhot_app.hand.model import HandModel


@pytest.fixture(params=[RIGHT_MODEL, LEFT_MODEL], ids=["right", "left"])
def model(request: pytest.FixtureRequest) -> HandModel:
    return request.param
