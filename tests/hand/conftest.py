"""The two shipped hands."""

import pytest
from shipped_rig import LEFT_MODEL, RIGHT_MODEL, model  # noqa: F401


@pytest.fixture(scope="session")
def right_hand():
    return RIGHT_MODEL


@pytest.fixture(scope="session")
def left_hand():
    return LEFT_MODEL
