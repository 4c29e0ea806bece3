"""Marker sets that RHOT ships, for the tests that start from them. Nothing of the master's is imported."""

from __future__ import annotations

from rhot_node.files import resource_path
from rhot_node.markers import load_markers

RHOT6, NAILS6, LANDMARKS21 = (load_markers(resource_path("markers", f"{name}.json"))
                              for name in ("rhot6", "nails6", "landmarks21"))
