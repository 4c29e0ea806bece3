"""The bundle adjustment: derivatives, exact truth from exact corners, robustness, priors."""

from __future__ import annotations

import numpy as np
import pytest
from stereo_twin import SIZE, Twin, stereo_twin

from rhot_app.calibration.bundle.adjustment import adjust
from rhot_app.calibration.bundle.model import (
    BundleState,
    Layout,
    LensFreedom,
    Observations,
    linearise,
    residuals,
)
from rhot_app.errors import CalibrationError
from rhot_app.geometry.camera import CameraModel, intrinsics_row
from rhot_app.geometry.transforms import inverse


def observed(twin: Twin) -> tuple[BundleState, Observations]:
    """The truth as a state, and its exact corners."""
    points = twin.board.object_points()
    views = [(c, s, view) for s, shot in enumerate(twin.views().shots) for c, view in enumerate(shot.views) if view]
    count = len(points)
    seen = Observations(np.repeat([c for c, _, _ in views], count), np.repeat([s for _, s, _ in views], count),
                        np.tile(points, (len(views), 1)), np.concatenate([view.pixels for _, _, view in views]))
    return BundleState(twin.lenses.copy(), twin.camera_from_world.copy(), twin.world_from_board.copy()), seen


def free_lenses(state: BundleState) -> list[LensFreedom]:
    return [LensFreedom.free(lens) for lens in state.lenses]


def disturbed(state: BundleState, layout: Layout, seed: int = 1) -> BundleState:
    """The truth, 10 px, a degree and centimetres off."""
    rng = np.random.default_rng(seed)
    step = 0.02 * rng.normal(size=layout.size)
    step[:layout.camera_at] *= np.tile([500.0, 500.0, 500.0, 500.0, 1.0, 1.0, 0.01, 0.01, 0.0], 2)[:layout.camera_at]
    return layout.moved(state, step)


def test_expected_corners_are_those_of_the_camera_model() -> None:
    twin = stereo_twin(shots=3)
    state, seen = observed(twin)
    world = np.einsum("mij,mj->mi", state.world_from_board[seen.shot][:, :3, :3], seen.points)
    world += state.world_from_board[seen.shot][:, :3, 3]
    for camera in (0, 1):
        mine = seen.camera == camera
        pose = state.camera_from_world[camera]
        model = CameraModel(*SIZE, intrinsics_row(state.lenses[camera]), inverse(pose), pose)
        assert np.allclose(seen.pixels[mine] - residuals(state, seen)[mine], model.project(world[mine]), atol=1e-9)


def test_derivatives_agree_with_differences() -> None:
    state, seen = observed(stereo_twin(shots=4))
    layout = Layout(free_lenses(state), 4, seen)
    state = disturbed(state, layout)
    jacobian = layout.jacobian(linearise(state, seen)).toarray()
    for column in range(layout.size):
        step = np.zeros(layout.size)
        step[column] = 1e-4 if column % 9 < 4 and column < layout.camera_at else 1e-6
        ahead, behind = (residuals(layout.moved(state, sign * step), seen).ravel() for sign in (1.0, -1.0))
        numeric = (behind - ahead) / (2.0 * step[column])
        assert np.allclose(jacobian[:, column], numeric, rtol=1e-5, atol=1e-5 * max(1.0, np.abs(numeric).max())), column


def test_exact_corners_give_the_truth_back() -> None:
    truth, seen = observed(stereo_twin())
    layout = Layout(free_lenses(truth), 14, seen)
    bundle = adjust(disturbed(truth, layout), seen, free_lenses(truth))
    assert np.allclose(bundle.state.lenses, truth.lenses, rtol=1e-8, atol=1e-9)
    assert np.allclose(bundle.state.camera_from_world, truth.camera_from_world, atol=1e-9)
    assert np.allclose(bundle.state.world_from_board, truth.world_from_board, atol=1e-9)


def test_wrong_corners_hardly_pull() -> None:
    truth, seen = observed(stereo_twin())
    rng = np.random.default_rng(3)
    pixels = seen.pixels + rng.normal(0.0, 0.1, seen.pixels.shape)
    wrong = rng.choice(len(seen), 30, replace=False)
    pixels[wrong] += 20.0
    fixed = [LensFreedom.fixed()] * 2
    off = {}
    for name, those in (("clean", np.setdiff1d(np.arange(len(seen)), wrong)), ("all", np.arange(len(seen)))):
        mask = np.isin(np.arange(len(seen)), those)
        some = Observations(seen.camera, seen.shot, seen.points, pixels).only(mask)
        bundle = adjust(truth, some, fixed)
        off[name] = np.linalg.norm(bundle.state.camera_from_world[1, :3, 3] - truth.camera_from_world[1, :3, 3])
        assert bundle.noise_px == pytest.approx(0.1, rel=0.15 if name == "clean" else 4.0)
    assert off["all"] < off["clean"] + 1e-4


def test_a_prior_holds_what_the_corners_leave_open() -> None:
    truth, seen = observed(stereo_twin(shots=3))
    rng = np.random.default_rng(5)
    noisy = Observations(seen.camera, seen.shot, seen.points, seen.pixels + rng.normal(0.0, 0.3, seen.pixels.shape))
    std = np.repeat([1e-4, 1e-8], [4, 8])
    held = adjust(truth, noisy, [LensFreedom.free(lens, std) for lens in truth.lenses])
    loose = adjust(truth, noisy, free_lenses(truth))
    assert np.abs(held.state.lenses - truth.lenses).max() < 1e-3
    assert np.abs(loose.state.lenses - truth.lenses).max() > 0.1
    assert np.all(np.diag(held.covariance)[:18] <= np.tile(std[:9], 2) ** 2 * 1.001)


def test_square_pixels_stay_square() -> None:
    truth, seen = observed(stereo_twin(shots=6))
    lenses = truth.lenses.copy()
    lenses[:, 1] = lenses[:, 0]
    start = BundleState(lenses, truth.camera_from_world, truth.world_from_board)
    bundle = adjust(start, seen, [LensFreedom.free(lens, square_pixels=True) for lens in lenses])
    assert np.allclose(bundle.state.lenses[:, 0], bundle.state.lenses[:, 1])


def test_too_few_corners_are_refused() -> None:
    truth, seen = observed(stereo_twin(shots=1))
    few = seen.only(np.arange(len(seen)) % 54 < 3)
    with pytest.raises(CalibrationError, match="do not determine"):
        adjust(truth, few, free_lenses(truth))


def test_work_is_reported_and_can_be_stopped() -> None:
    truth, seen = observed(stereo_twin(shots=3))

    class CancelledError(Exception):
        """What a cancelled job raises."""

    told: list[float] = []

    def stop(text: str, fraction: float) -> None:
        told.append(fraction)
        if len(told) == 2:
            raise CancelledError

    start = disturbed(truth, Layout(free_lenses(truth), 3, seen))
    with pytest.raises(CancelledError):
        adjust(start, seen, free_lenses(truth), progress=stop)
    assert told == sorted(told)
