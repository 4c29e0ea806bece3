"""The memory of sights, its kernels against plain numpy, and that nothing published is written to again."""

from dataclasses import fields, replace

import numpy as np
import pytest
from modelled_hand import model_rig, moving, sights

from rhot_app.tracking.kalman.marker_block import MarkerBlock
from rhot_app.tracking.kalman.rows import Outcome, Verdict
from rhot_app.tracking.kalman.share import Share
from rhot_app.tracking.kalman.wearing import compile_wearing
from rhot_app.tracking.make import make_tracker
from rhot_app.tracking.model_start import count_apart
from rhot_app.tracking.sights import UNLIKELY, Seen, Sights, all_in_sight, seen_clearly
from rhot_app.tracking.tracks import DOUBTFUL
from rhot_node.wire.messages import MarkerFlag

RIG = model_rig()
WEARING = compile_wearing(RIG)
CAMERAS, MARKERS = len(RIG.nodes), len(RIG.markers.markers)
FRESH_NS = 60_000_000


def twin(seen, block, outcome):
    """What `Sights.believe` shall make of `seen`, in plain numpy."""
    outcome = outcome.verdict
    frame, camera = block.frame, block.observations.camera
    found = Seen(*(array.copy() for array in seen))
    sight = outcome.source[outcome.believed, 1]
    marker = frame.label[sight]
    times = block.t_ns + (1e9 * frame.late_s[sight]).astype(np.int64)
    newer = times >= found.times[camera, marker]
    sight, marker = sight[newer], marker[newer]
    found.times[camera, marker] = times[newer]
    found.pixels[camera, marker] = frame.pixels[sight]
    found.covariances[camera, marker] = frame.covariances[sight]
    unlikely = outcome.widening[outcome.believed][newer] > UNLIKELY
    found.doubtful[camera, marker] = ((block.observations.flags[sight] & DOUBTFUL) != 0) | unlikely
    return found


def random_frames(seed):
    """Blocks with flags and names at random, and what was believed of them."""
    rng = np.random.default_rng(seed)
    frames = sights(RIG, moving(), 0.4)
    for k in rng.permutation(len(frames)):
        flags = rng.choice([0, int(MarkerFlag.LOST), int(MarkerFlag.PARTIAL), int(MarkerFlag.ACQUIRED)], MARKERS)
        block = MarkerBlock(WEARING, replace(frames[k], flags=flags.astype(np.uint16)))
        block.frame.label[:] = rng.permutation(MARKERS)
        shown = np.flatnonzero(block.frame.seen)
        source = np.array([(block.observations.camera, sight, block.frame.label[sight]) for sight in shown])
        verdict = Verdict(rng.random(len(shown)) < 0.7, rng.choice([1.0, 2.0, 3.0], len(shown)),
                          source.reshape(-1, 3).astype(np.int64))
        yield block, Outcome(Share(verdict), 0, len(shown))


@pytest.mark.parametrize("seed", range(3))
def test_what_is_believed_is_remembered_as_plain_numpy_would(seed):
    memory = Sights(CAMERAS, MARKERS)
    for block, outcome in random_frames(seed):
        expected = twin(memory.seen, block, outcome)
        assert memory.believe(block, outcome) == np.count_nonzero(outcome.verdict.believed)
        for name, array, other in zip(Seen._fields, memory.seen, expected, strict=True):
            np.testing.assert_array_equal(array, other, err_msg=name)
    assert memory.seen.doubtful.any() and (memory.seen.times >= 0).all()


def test_clearly_seen_is_what_two_cameras_see_beyond_doubt_just_now():
    rng = np.random.default_rng(4)
    found = []
    for _ in range(50):
        seen = Seen(rng.choice([-1, 10**9, 10**9 + FRESH_NS, 10**9 + 2 * FRESH_NS, 10**9 + 3 * FRESH_NS], (3, MARKERS)),
                    np.zeros((3, MARKERS, 2)), np.zeros((3, MARKERS, 2, 2)), rng.random((3, MARKERS)) < 0.2,
                    np.array([1, 1, 2]) * FRESH_NS)
        t_ns = 10**9 + FRESH_NS
        fresh = (seen.times >= 0) & (np.abs(t_ns - seen.times) <= seen.fresh_ns[:, None]) & ~seen.doubtful
        found += (fresh.sum(axis=0) >= 2).tolist()
        assert [seen_clearly(seen, t_ns, m) for m in range(MARKERS)] == found[-MARKERS:]
    assert any(found) and not all(found)


def test_all_is_in_sight_while_two_cameras_saw_every_marker_within_two_fresh_times():
    seen, t_ns = Sights(CAMERAS, MARKERS).seen, 10**9
    assert not all_in_sight(seen, t_ns)
    seen.times[:] = t_ns - 2 * seen.fresh_ns[:, None]
    seen.doubtful[:] = True  # badly seen is seen
    assert all_in_sight(seen, t_ns)
    seen.times[1, 3] -= 1
    assert not all_in_sight(seen, t_ns)


def test_the_newest_frames_are_shown_with_what_they_lost():
    memory = Sights(CAMERAS, MARKERS)
    frames = [frame for frame in sights(RIG, moving(), 0.2) if frame.camera == 1]
    late = replace(frames[0], t_row0_master_ns=frames[1].t_row0_master_ns + 5_000_000)
    for frame in (frames[0], frames[2], late):
        assert memory.enter(MarkerBlock(WEARING, frame))
    assert not memory.enter(MarkerBlock(WEARING, frames[2]))
    pixels, flags = memory.last_seen()
    np.testing.assert_array_equal(pixels[1], frames[2].pixels)
    assert np.isnan(pixels[0]).all() and (flags[0] == MarkerFlag.LOST).all() and (flags[1] == frames[2].flags).all()
    memory.reset()
    assert np.isnan(memory.last_seen()[0]).all()
    np.testing.assert_array_equal(pixels[1], frames[2].pixels)


def test_markers_apart_are_counted_and_those_not_located_are_not():
    rng = np.random.default_rng(5)
    one, other = rng.normal(0.0, 0.01, (2, 40, 3))
    one[:5, 1] = np.nan
    expected = np.count_nonzero(np.linalg.norm(one - other, axis=1) > 0.02)
    assert 0 < expected < 35 and count_apart(one, other, 0.02) == expected


def test_a_state_is_nobody_elses():
    tracker, before = make_tracker(RIG), []
    for frame in sights(RIG, moving(), 0.5):
        tracker.ingest(frame)
        state = tracker.solve()
        arrays = [(field.name, getattr(state, field.name)) for field in fields(state)
                  if isinstance(getattr(state, field.name), np.ndarray)]
        for name, array, copy in before:
            np.testing.assert_array_equal(array, copy, err_msg=name)
        before = [(name, array, array.copy()) for name, array in arrays]
