"""What holds for all tests: the master's keys lie in a folder of their own, never in the user's."""

from __future__ import annotations

import os
import shutil
import tempfile

import pytest

_folder = pytest.StashKey[str]()


def pytest_configure(config: pytest.Config) -> None:
    """Programs that a test starts inherit the place."""
    config.stash[_folder] = tempfile.mkdtemp(prefix="rhot-test-keys-")
    os.environ["RHOT_KEYS"] = f"{config.stash[_folder]}/keys.json"


def pytest_unconfigure(config: pytest.Config) -> None:
    """Leave nothing behind."""
    shutil.rmtree(config.stash[_folder], ignore_errors=True)
