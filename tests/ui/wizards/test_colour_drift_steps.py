"""The colour wizard says when the light is another one than that of the rig's colours, or of those just picked; and why
a marker is not found."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from colour_scenes import PAINTS, picture
from fake_engine import synthetic_rig
from paint_scene import PaintScene

from rhot_app.calibration.kinds.colours import propose
from rhot_app.calibration.registry import InForce, calibration
from rhot_app.calibration.verdict import Grade
from rhot_app.project import Rig
from rhot_app.ui.backend.feed import Picture
from rhot_app.ui.wizards.colours.bounds import BoundsStep
from rhot_app.ui.wizards.colours.pick import PickStep
from rhot_app.ui.wizards.colours.separation import SeparationStep
from rhot_node.detect.illuminant import gains_of
from rhot_node.detect.image import to_bgr

COLOURS = calibration("colours"), InForce(synthetic_rig())

COLDER = (("gains", tuple(gains_of(-0.35))),)
EMPTY: tuple = ("nothing",)
MOST = 12  # pictures after which what is seen now outweighs what was seen before


@pytest.fixture(scope="module")
def rig() -> Rig:
    return synthetic_rig()


@cache
def frame(seed: int, light: tuple) -> np.ndarray:
    return to_bgr(picture({}, seed=seed) if light == EMPTY else picture(seed=seed, **dict(light)))


def look(step: PickStep | BoundsStep | SeparationStep, times: int = 4, light: tuple = ()) -> None:
    """Let a step see some pictures by a light."""
    for number in range(times):
        image = frame(number % 3, light)
        step.accept_observation(step.observe({"left": Picture("left", image, number, number, number)}))


@pytest.fixture(scope="module")
def steps(rig: Rig) -> tuple[BoundsStep, SeparationStep]:
    """All markers picked and learnt in the light of the scene."""
    picks = PickStep(rig.markers, ("left",))
    look(picks, 1)
    for name in PAINTS:
        x, y = PaintScene.where(name)
        picks.chosen = name
        assert picks.pick(picks.masked["left"].picture, x, y, 0.0, 0.0), picks.problem
    bounds = BoundsStep(*COLOURS, picks)
    bounds.enter()
    task = bounds.task()
    assert task is not None and task.function is calibration("colours").solve
    bounds.take_result(task.function(*task.arguments, progress=lambda text, fraction: None))
    return bounds, SeparationStep(*COLOURS, bounds)


@pytest.mark.parametrize(("light", "word"), [((), None), (COLDER, "colder")])
def test_the_rigs_colours_are_held_against_the_light_before_anything_is_picked(rig: Rig, light: tuple,
                                                                               word: str | None) -> None:
    picks = PickStep(rig.markers, ("left",))
    look(picks, light=light)
    hint = picks.view().hint
    assert ("By the rig's colours" in hint) == (word is not None) and (word or "") in hint


def test_a_light_that_has_changed_since_the_picking_is_said_on_the_mask_and_in_the_verdict(
        rig: Rig, steps: tuple[BoundsStep, SeparationStep]) -> None:
    bounds, apart = steps
    look(bounds)
    assert "colder" not in bounds.view().hint
    look(bounds, MOST, COLDER)
    assert "were picked" in bounds.view().hint and "colder" in bounds.view().hint
    apart.enter()
    look(apart)
    calm = apart.view().verdict
    assert calm is not None and "temperature" not in calm.codes
    look(apart, MOST, COLDER)
    verdict = apart.view().verdict
    assert verdict is not None and "temperature" in verdict.codes
    assert verdict.grade is Grade.FAIR and "6 colours" in verdict.sentence
    (finding,) = [one for one in verdict.findings if one.code == "temperature"]
    assert "left" in finding.figure and "colder" in finding.figure
    proposal = propose(replace(apart.result, verdict=verdict), InForce(rig))
    assert proposal is not None and proposal.verdict == verdict
    look(apart, 2 * MOST)  # the colder pictures are remembered for a while
    assert apart.view().verdict == calm


@pytest.mark.parametrize(("change", "said"), [
    ({"ring": (25, 165, 205)}, ()),
    ({"ring": None}, ("ring", "0 of 1", "not found")),
    ({"ring": (110, 121, 125)}, ("not found", "too pale")),
    ({"little": (25, 165, 205)}, ("ring", "1 of 1", "doubtful", "1 more of its colour")),
], ids=["seen", "gone", "pale", "twice"])
def test_the_masks_page_says_why_the_chosen_marker_is_not_found_or_in_doubt(
        steps: tuple[BoundsStep, SeparationStep], change: dict, said: tuple) -> None:
    bounds = BoundsStep(*COLOURS, steps[0].picks)
    bounds.enter()
    bounds.take_result(steps[0].result)
    bounds.chosen = "ring"
    paints = {name: rgb for name, rgb in {**PAINTS, **change}.items() if rgb is not None}
    image = to_bgr(picture(paints, background=(60, 62, 66)))
    bounds.accept_observation(bounds.observe({"left": Picture("left", image, 0, 0, 0)}))
    hint = bounds.view().hint
    assert all(words in hint for words in said) and ("left: " in hint) == bool(said)


def test_markers_that_were_never_seen_say_nothing_of_the_light(rig: Rig) -> None:
    picks = PickStep(rig.markers, ("left",))
    look(picks, light=EMPTY)
    assert "rig's colours" not in picks.view().hint
