"""The live twin tells when it is slower than its preset: soon, seldom, and when that is over."""

from __future__ import annotations

from typing import Any

from rhot_app.simulator.nodes.live_cameras import Pace


def said(pace: Pace, begin_s: float, seconds: float, rate_hz: float) -> list[dict[str, Any]]:
    """Events of an even run of frames."""
    events = [pace.note(begin_s + k / rate_hz) for k in range(round(seconds * rate_hz))]
    return [event for event in events if event is not None]


def test_full_speed_is_not_worth_a_word() -> None:
    assert said(Pace(40.0), 5.0, 20.0, 40.0) == []


def test_slow_is_said_once_again_when_it_changes_and_when_it_is_over() -> None:
    pace = Pace(40.0)
    first = said(pace, 0.0, 20.0, 20.0)
    assert [event["event"] for event in first] == ["slow"]
    assert first[0]["preset_hz"] == 40.0 and abs(first[0]["achieved_hz"] - 20.0) < 1.0
    assert "20 instead of 40 frames" in first[0]["text"]
    assert said(pace, 20.0, 20.0, 19.0) == []
    worse = said(pace, 40.0, 20.0, 8.0)
    assert worse and worse[-1]["event"] == "slow" and abs(worse[-1]["achieved_hz"] - 8.0) < 1.0
    over = said(pace, 60.0, 20.0, 40.0)
    assert over[-1]["event"] == "in_time" and len(over) <= 2
