"""The mouse's measures of a hand that is not tracked all the time: figures where there are any, sentences elsewhere."""

from __future__ import annotations

import json

import numpy as np
import pytest

from rhot_app.mouse import measure
from rhot_app.mouse.measure import coupling, latency, one_camera, report, resolution
from rhot_app.mouse.script import Script


class Untracked(measure.MouseRun):
    """A run without a cursor, until the first button is clicked."""

    def during(self, begin_s: float, end_s: float) -> np.ndarray:
        return np.full(1, begin_s > 4.0)


@pytest.mark.filterwarnings("error")
def test_a_phase_without_a_tracked_hand_has_no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    class Cursor(Untracked):
        cursor = true_cursor = np.zeros((1, 3))  # type: ignore[assignment]

    lost = Cursor(Script(), np.zeros(1), [], [], [], np.zeros((1, 3)), np.zeros(1))
    monkeypatch.setattr(measure, "play", lambda *_, **__: lost)
    figures = {"seed": 1, "set_up": "markers, two cameras", "buttons": {},
               "pictures": False, "speed": [], "coupling": coupling(1), "resolution": [resolution(0.0, 1)],
               "latency": latency(lost), "throughput": {"true": None, "tracked": None}, "one_camera": one_camera(1),
               "place": []}
    assert figures["coupling"][0] == {"moved": "right", "rms": None, "peak": None}
    assert figures["coupling"][-1]["rms"] is not None
    assert figures["latency"] is None
    json.dumps(figures, allow_nan=False)
    assert report([figures]).count("not tracked") >= 5
