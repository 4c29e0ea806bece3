"""What nodes say of their machines reaches the operator as advice; nonsense does not."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from rhot_app.engine.node_meter import SENTENCE_MAX, health_advice, sees_black
from rhot_node.health.checks import BLACK_PICTURE, Throttled, check_heat, check_power


def test_a_nodes_own_checks_become_advice() -> None:
    checks = [check_power(Throttled.UNDER_VOLTAGE), check_heat(76.0, Throttled(0))]
    answer = msgspec.json.decode(msgspec.json.encode({"ok": True, "health": checks}))
    power, heat = health_advice("left", answer)
    assert power.level == "error" and power.text.startswith("Node left: its supply voltage is too low now")
    assert "power supply" in power.text
    assert heat.level == "warning" and "76 °C" in heat.text and "fan" in heat.text


def test_a_black_picture_is_known_and_not_said_twice() -> None:
    answer = msgspec.json.decode(msgspec.json.encode({"health": [BLACK_PICTURE]}))
    assert sees_black(answer) and health_advice("left", answer) == ()
    assert not sees_black({}) and not sees_black({"health": ["black"]})


@pytest.mark.parametrize("health", [
    None, "hot", 7, {}, [], [None], ["hot"], [{}], [{"level": "error"}], [{"level": "fatal", "text": "x"}],
    [{"level": ["error"], "text": "x"}], [{"level": "error", "text": 7}], [{"level": "ok", "text": "fine"}]])
def test_nonsense_is_passed_over(health: Any) -> None:
    assert health_advice("left", {} if health is None else {"health": health}) == ()


def test_a_talkative_node_is_cut_short() -> None:
    many = health_advice("left", {"health": [{"level": "error", "text": "x" * 10_000}] * 100})
    assert len(many) == 8 and all(len(advice.text) < SENTENCE_MAX + 20 for advice in many)


def test_a_node_does_not_steer_the_terminal() -> None:
    (advice,) = health_advice("left", {"health": [{"level": "error", "text": "\x1b[2Jhot\n", "remedy": "\x9bcool"}]})
    assert advice.text.isprintable()
