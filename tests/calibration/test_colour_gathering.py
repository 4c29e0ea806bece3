"""Gathering samples from several cameras: one names, the others follow, and everything can be taken back."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from colour_scenes import PAINTS, box, picture, place

from rhot_app.calibration.colour.colours import solve_colours
from rhot_app.calibration.colour.gathering import ColourGathering
from rhot_app.calibration.colour.samples import VIEWS_MOST
from rhot_app.calibration.colour.separability import SKIN
from rhot_app.calibration.verdict import Grade
from rhot_app.errors import CalibrationError
from rhot_node.detect.search import ColourGate
from rhot_node.markers import ChromaModel

BESIDE = (12.0, 0.0)


@pytest.fixture
def gathering():
    return ColourGathering(("left", "right"))


def name_all(gathering, image):
    for name in PAINTS:
        gathering.pick(name, "left", image, place(name))


def test_what_is_named_in_one_camera_is_found_in_the_others(gathering) -> None:
    name_all(gathering, picture())
    taken = gathering.follow({"right": picture(shift=BESIDE, seed=1)})
    assert set(taken["right"]) == set(PAINTS)
    for name, region in taken["right"].items():
        _, columns = np.nonzero(region.sample)
        assert abs(2 * columns.mean() + 0.5 - place(name, BESIDE)[0]) < 2.0
    assert all(gathering.pictures(name) == 2 for name in PAINTS)
    assert [len(np.unique(one.frame)) for one in gathering.samples] == [2] * len(PAINTS)


def test_something_of_another_size_is_not_taken_over(gathering) -> None:
    gathering.pick("ring", "left", picture(), place("ring"))
    hidden = {name: rgb for name, rgb in PAINTS.items() if name != "ring"}
    other = picture(hidden, clutter=[(270.0, 200.0, 25.0, PAINTS["ring"])])
    assert gathering.follow({"right": other}) == {}


def test_of_two_things_of_its_colour_the_one_of_the_markers_size_is_taken_over_and_of_two_alike_none(gathering) -> None:
    for name in ("thumb", "middle", "ring"):
        gathering.pick(name, "left", picture(background=(60, 62, 66)), place(name))
    twice = {"right": picture(clutter=[(290.0, 200.0, 9.0, PAINTS["ring"])], background=(60, 62, 66))}
    assert "ring" not in gathering.follow(twice)["right"] and gathering.pictures("ring") == 1
    larger = {"right": picture(clutter=[(280.0, 200.0, 26.0, PAINTS["ring"])], background=(60, 62, 66))}
    _, columns = np.nonzero(gathering.follow(larger)["right"]["ring"].sample)
    assert abs(2 * columns.mean() + 0.5 - place("ring")[0]) < 2.0


def test_what_was_said_before_a_pick_and_who_has_not_seen_a_marker_is_known(gathering) -> None:
    image = picture()
    gathering.pick("ring", "left", image, place("ring"))
    assert gathering.unseen_by("right") == ("ring",) and gathering.unseen_by("left") == ()
    gathering.pick("ring", "right", image, place("ring"))
    assert gathering.earlier == {"ring": ()} and gathering.unseen_by("right") == ()
    gathering.pick("ring", "left", image, place("little"))
    (earlier,) = gathering.earlier["ring"]
    assert abs(np.degrees(earlier.hue_rad) + 60.0) < 5.0 and gathering.last_pick("ring") == 2


def test_a_pick_is_taken_back_and_the_one_before_counts_again(gathering) -> None:
    image = picture()
    gathering.pick("ring", "left", image, box("ring"))
    before = gathering.samples[0].rgb
    gathering.pick("ring", "left", image, box("wrist"))
    assert gathering.samples[0].rgb != before
    assert gathering.take_back() == "ring" and gathering.samples[0].rgb == before
    assert gathering.take_back() == "ring" and gathering.samples == () and gathering.names == ()
    assert gathering.take_back() is None


def test_a_click_on_nothing_changes_nothing(gathering) -> None:
    gathering.pick("ring", "left", picture(), place("ring"))
    revision = gathering.revision
    with pytest.raises(CalibrationError, match="ring"):
        gathering.pick("ring", "left", picture(background=(90, 90, 90)), (5.0, 5.0))
    assert gathering.revision == revision and gathering.samples


def test_skin_is_gathered_beside_the_markers(gathering) -> None:
    x, y = place("thumb")
    gathering.pick(SKIN, "left", picture(), (x, y + 45))
    assert len(gathering.skin) >= 50 and gathering.names == () and gathering.samples == ()
    with pytest.raises(CalibrationError, match="more of the hand"):
        gathering.pick(SKIN, "left", picture(), (3, 3, 5, 5))


def test_a_marker_named_late_still_has_a_picture_that_shows_it(gathering) -> None:
    image = picture()
    gathering.pick("ring", "left", image, place("ring"))
    for step in range(1, 15):
        gathering.follow({"left": picture(shift=(5.0 * (step % 2), 9.0 * step), seed=step)})
    assert len(gathering.views) == VIEWS_MOST
    gathering.pick("wrist", "left", picture(seed=40), place("wrist"))
    assert sum("wrist" in view.paint for view in gathering.views) == 1 and len(gathering.views) == VIEWS_MOST


def test_bounds_set_by_hand_are_used_and_judged(gathering) -> None:
    name_all(gathering, picture())
    learnt = solve_colours(gathering.samples, gathering.views)
    wide = ChromaModel(**{field: getattr(learnt.markers.markers[2].chroma, field) for field in ("cb", "cr")},
                       hue_tolerance_deg=60.0, magnitude_min=10.0, luma_min=0, luma_max=255)
    wider = msgspec.structs.replace(learnt.markers.markers[4].chroma, hue_tolerance_deg=80.0)
    report = solve_colours(gathering.samples, gathering.views, given={"middle": wide, "little": wider})
    assert [report.markers.markers[k].chroma for k in (2, 4)] == [wide, wider]
    assert report.markers.markers[0] == learnt.markers.markers[0]
    passing = [np.count_nonzero(ColourGate(one.markers).labels(picture()) == 3) for one in (learnt, report)]
    assert passing[1] > passing[0]
    grades = {(one.figure.split()[3], one.grade) for one in report.verdict.findings if one.code == "swallowed"}
    assert grades >= {("middle", Grade.FAIR), ("little", Grade.POOR)}, "into another's hues, or over the middle of them"
    assert not report.verdict.acceptable and "swallowed" not in learnt.verdict.codes
