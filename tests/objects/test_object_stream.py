"""Pose streams: a real one that stands still, jumps that the gate rejects, fast motion that it keeps, bad lines."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rhot_app.errors import ObjectError
from rhot_app.estimation.se3 import exp_so3, log_so3, quaternion_from_rotation
from rhot_app.geometry.transforms import rigid
from rhot_app.objects.state import Validity
from rhot_app.objects.stream import PoseStream, noise_of, read_pose_stream, track_stream

STILL = Path("/work/shared/data/vive/tracker_stationary.csv")
if not STILL.exists():
    STILL = Path(__file__).resolve().parents[3] / "shared" / "data" / "vive" / "tracker_stationary.csv"
needs_vive = pytest.mark.skipif(not STILL.exists(), reason=f"the recorded pose stream is not there ({STILL})")

HEADER = "t,x,y,z,qw,qx,qy,qz"
STEP_NS = 8_000_000
NOISE_M, NOISE_RAD = 0.1e-3, 0.5e-3


def moving(seconds: float, seed: int = 1, sudden: bool = False) -> tuple[PoseStream, np.ndarray]:
    """A stream with white noise, and its true poses: at rest, then to and fro with up to 10 m/s^2 and 2 m/s, turning.

    `sudden`: the acceleration changes from 0 to 10 m/s^2, and from there to -10 m/s^2, from one sample to the next.
    """
    rng, t_ns = np.random.default_rng(seed), np.arange(0, round(1e9 * seconds), STEP_NS)
    phase = (1e-9 * t_ns - 0.5) * (2.0 * np.pi / 0.8 if sudden else 10.0)
    wave = np.sign(np.cos(phase)) if sudden else np.sin(phase)
    acceleration = np.where(phase < 0.0, 0.0, 10.0 * wave)
    speed = np.cumsum(acceleration) * 1e-9 * STEP_NS
    place = np.cumsum(speed) * 1e-9 * STEP_NS
    true = np.array([rigid(exp_so3([0.0, 0.5 * np.sin(3e-9 * t), 1e-9 * t]), [x, 0.1, 0.5])
                     for t, x in zip(t_ns, place, strict=True)])
    noisy = np.array([rigid(exp_so3(NOISE_RAD * rng.normal(size=3)) @ one[:3, :3],
                            one[:3, 3] + NOISE_M * rng.normal(size=3)) for one in true])
    assert seconds < 2.0 or 1.9 < np.abs(speed).max() < 2.1
    return PoseStream(t_ns, noisy), true


def jumped(stream: PoseStream, share: float, seed: int = 2) -> tuple[PoseStream, np.ndarray]:
    """The stream with 100 mm jumps, one sample long each, and which samples these are."""
    rng, poses = np.random.default_rng(seed), stream.poses.copy()
    chosen = rng.random(len(poses)) < share
    chosen[:20] = False
    for number in np.flatnonzero(chosen):
        direction = rng.normal(size=3)
        poses[number, :3, 3] += 0.1 * direction / np.linalg.norm(direction)
    return PoseStream(stream.t_ns, poses), chosen


def test_the_noise_is_that_of_the_stream_even_if_it_moves_and_jumps() -> None:
    for stream in (moving(4.0)[0], jumped(moving(4.0)[0], 0.05)[0]):
        sd = np.sqrt(np.diag(noise_of(stream.poses)))
        np.testing.assert_allclose(sd[:3], NOISE_M, rtol=0.5)
        np.testing.assert_allclose(sd[3:], NOISE_RAD, rtol=0.5)


@pytest.mark.parametrize("sudden", [False, True])
def test_fast_motion_is_kept(sudden: bool) -> None:
    stream, true = moving(4.0, sudden=sudden)
    states = track_stream("tracker", stream)
    accepted = np.array([kept for _, kept in states])
    error = np.array([np.linalg.norm(state.world_from_object[:3, 3] - pose[:3, 3])
                      for (state, _), pose in zip(states, true, strict=True)])
    assert (~accepted).sum() <= (4 if sudden else 1)  # 99.9 % of 500
    assert error.max() < (5e-3 if sudden else 1e-3)
    assert all(state.validity is Validity.TRACKED for state, _ in states)


@pytest.mark.parametrize("share", [0.01, 0.05])
def test_jumps_are_rejected_and_nothing_else(share: float) -> None:
    stream, true = moving(4.0)
    stream, chosen = jumped(stream, share)
    states = track_stream("tracker", stream)
    accepted = np.array([kept for _, kept in states])
    error = np.array([np.linalg.norm(state.world_from_object[:3, 3] - pose[:3, 3])
                      for (state, _), pose in zip(states, true, strict=True)])
    assert not accepted[chosen].any()
    assert accepted[~chosen].mean() > 0.99
    assert error.max() < 10e-3


def test_an_object_that_was_moved_in_a_gap_is_found_again() -> None:
    stream, _ = moving(2.0)
    poses = stream.poses.copy()
    poses[150:, :3, 3] += [0.0, 0.8, 0.0]
    states = track_stream("tracker", PoseStream(stream.t_ns, poses))
    error = [np.linalg.norm(state.world_from_object[:3, 3] - pose[:3, 3])
             for (state, _), pose in zip(states[156:], poses[156:], strict=True)]
    assert max(error) < 5e-3


@cache
def still() -> PoseStream:
    """The first 1500 samples of a real tracker that stands still."""
    stream = read_pose_stream(STILL)
    return PoseStream(stream.t_ns[:1500], stream.poses[:1500])


@needs_vive
def test_a_real_tracker_that_stands_still() -> None:
    stream = still()
    sd = np.sqrt(np.diag(noise_of(stream.poses)))
    states = track_stream("vive", stream)
    accepted = np.array([kept for _, kept in states])
    places = np.array([state.world_from_object[:3, 3] for state, _ in states])
    steps = np.diff(places[100:], axis=0).std(), np.diff(stream.poses[100:, :3, 3], axis=0).std()
    assert 0.0003e-3 < sd[0] < 0.09e-3  # a filtered stream: its errors are slow
    assert accepted.mean() > 0.98
    assert steps[0] < steps[1]
    assert np.abs(places - np.median(places, axis=0)).max() < 2e-3


@needs_vive
def test_jumps_in_a_real_stream_are_rejected() -> None:
    stream, chosen = jumped(still(), 0.02)
    accepted = np.array([kept for _, kept in track_stream("vive", stream)])
    assert not accepted[chosen].any()
    assert accepted[~chosen].mean() > 0.98


def test_a_file_is_read_as_written(tmp_path: Path) -> None:
    stream, _ = moving(0.4)
    path = tmp_path / "poses.csv"
    rows = [",".join(f"{value:.9f}" for value in (1e-9 * t, *pose[:3, 3], *quaternion_from_rotation(pose[:3, :3])))
            for t, pose in zip(stream.t_ns, stream.poses, strict=True)]
    path.write_text("\n".join([HEADER, *rows, "", ""]))
    read = read_pose_stream(path)
    np.testing.assert_array_equal(read.t_ns, stream.t_ns)
    for one, other in zip(read.poses, stream.poses, strict=True):
        assert np.linalg.norm(log_so3(one[:3, :3] @ other[:3, :3].T)) < 1e-7
        np.testing.assert_allclose(one[:3, 3], other[:3, 3], atol=1e-8)


LINE = "0.1,0,0,0.5,1,0,0,0"


@pytest.mark.parametrize(("text", "line", "says"), [
    ("", 1, "Let the first line be"),
    (LINE, 1, "Let the first line be"),
    (f"{HEADER}\n{LINE}\n0.2,0,0,zero,1,0,0,0", 3, "no number"),
    (f"{HEADER}\n{LINE}\n0.2,0,0,nan,1,0,0,0", 3, "no number"),
    (f"{HEADER}\n{LINE}\n0.2,0,0,inf,1,0,0,0", 3, "no number"),
    (f"{HEADER}\n{LINE}\n0.2,0,0,0.5,1,0,0", 3, "Remove or complete"),
    (f"{HEADER}\n{LINE}\n\x1b[2J", 3, "Remove or complete"),
    (f"{HEADER}\n{LINE}\n0.05,0,0,0.5,1,0,0,0", 3, "Sort the lines"),
    (f"{HEADER}\n0.1,0,0,0.5,0,0,0,0", 2, "quaternion"),
    (f"{HEADER}\n0.1,0,0,500000,1,0,0,0", 2, "metres"),
    (f"{HEADER}\n", 0, "Is the file complete"),
])
def test_bad_lines_are_named_with_a_remedy(tmp_path: Path, text: str, line: int, says: str) -> None:
    path = tmp_path / "poses.csv"
    path.write_text(text)
    with pytest.raises(ObjectError) as caught:
        read_pose_stream(path)
    assert str(caught.value).startswith(str(path)) and says in str(caught.value)
    assert not line or f"line {line}:" in str(caught.value)
    assert str(caught.value).isprintable()


def test_a_file_that_is_none_and_a_short_one_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ObjectError, match="no such file"):
        read_pose_stream(tmp_path / "none.csv")
    (tmp_path / "image.csv").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(ObjectError, match="no text"):
        read_pose_stream(tmp_path / "image.csv")
    short = moving(0.4)[0]
    with pytest.raises(ObjectError, match="longer recording"):
        noise_of(short.poses[:7])
