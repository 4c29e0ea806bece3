"""Template residuals: Jacobians against finite differences, occlusion, light, pictures without texture or object."""

import numpy as np
import pytest
from objects import object_of
from painted_object import meshes_of, picture
from pictures import look_at, wall

from rhot_app.articulated.bodies import ANGLES, camera_rays, place
from rhot_app.articulated.layered import LayeredFrame, chain_rows
from rhot_app.articulated.outline import outline_of
from rhot_app.articulated.templates import TemplateSet, filtered, noise_gain
from rhot_app.articulated.visibility import NONE, segment, visibility
from rhot_app.estimation.layout import pose_matrix
from rhot_app.tracking.kinds.templates import ConstantVelocity

ANGLES_DEG = np.array([20.0, 30.0, 60.0, 50.0])
CAMERA = look_at(np.array([0.10, -0.28, 0.27]), np.array([0.04, 0.0, 0.0]), focal=500.0, width=400, height=300)
RECORD = CAMERA.record
RAYS = camera_rays(CAMERA)
BACKGROUND = wall(CAMERA, 3, False)
EMPTY = np.clip(BACKGROUND, 0.0, 255.0).astype(np.uint8)
MODEL, BODIES, NAMES = object_of("two_fingers")
PROCESS = ConstantVelocity(np.ones(10, bool))


def state_at(angles_deg=ANGLES_DEG, root=None):
    return np.concatenate([(np.eye(4) if root is None else root)[:3].ravel(), np.radians(angles_deg), np.zeros(10)])


def image_of(angles_deg=ANGLES_DEG, texture=0.15, gain=1.0):
    meshes = meshes_of(MODEL, 2, texture)
    for mesh in meshes:
        mesh.colours *= gain
    return picture(MODEL, meshes, np.eye(4), np.radians(angles_deg), CAMERA, BACKGROUND, 1, noise=1.0)


def placed_at(state):
    return place(BODIES, pose_matrix(state), state[ANGLES:ANGLES + 4])


def taken(kind="raw", texture=0.15):
    """Templates of both fingers, and the image that they were taken from."""
    image, state = image_of(texture=texture), state_at()
    templates, placed = TemplateSet(kind), placed_at(state)
    order = visibility(BODIES, placed, RECORD).order
    labels = segment(BODIES, placed, order, RECORD, RAYS)
    for layer in range(4):
        templates.take(layer, templates.images(image), labels, BODIES, placed, RECORD, RAYS, 1.0, True)
    return templates, image


def frame_of(templates, image, state, level=2, outline=False, background=None, layered=True):
    placed = placed_at(state)
    order = visibility(BODIES, placed, RECORD).order if layered else np.empty(0, np.int64)
    sigma = templates.sigmas_px[level]
    line = outline_of(BODIES, placed, order, RECORD) if outline else None
    return LayeredFrame(BODIES, order, RECORD, filtered(image, templates.kind, sigma),
                        templates.templates, templates.kind, sigma, level, 1.0, np.zeros((10, 10)), line,
                        None if background is None else filtered(background, templates.kind, sigma))


def test_points_of_a_link_follow_the_state_as_finite_differences_say():
    """Rehg eq. 2.16, on the tangent space of the tracker's process."""
    rng, state = np.random.default_rng(0), state_at()
    for layer, point in ((1, [-0.02, 0.003, 0.006]), (3, [-0.01, -0.004, 0.002])):
        direction = rng.normal(size=3)

        def along(step, layer=layer, point=point, direction=direction):
            frame = placed_at(PROCESS.retract(state, step)).frames[BODIES.layer_row[layer]]
            return direction @ (frame[:, :3] @ point + frame[:, 3])

        placed = placed_at(state)
        frame = placed.frames[BODIES.layer_row[layer]]
        row, = chain_rows(BODIES.dh, placed.root, placed.frames, BODIES.layer_row[[layer]],
                          (frame[:, :3] @ point + frame[:, 3])[None], direction[None])
        numerical = [(along(1e-6 * step) - along(-1e-6 * step)) / 2e-6 for step in np.eye(20)]
        np.testing.assert_allclose(numerical, [*row, *np.zeros(10)], atol=1e-8)


def test_outlines_move_as_the_contour_of_the_moved_object_does():
    """Rehg eq. 3.12: the outline of a moved finger lies where its points moved to, along their normals."""
    before, state = placed_at(state_at()), state_at()
    order = visibility(BODIES, before, RECORD).order
    line = outline_of(BODIES, before, order, RECORD)
    moved = placed_at(PROCESS.retract(state, np.r_[1e-4, -2e-4, 1e-4, 0.002, 0.003, -0.002, 0.004, -0.004, 0.003, 0.003,
                                                   np.zeros(10)]))
    new = outline_of(BODIES, moved, order, RECORD, 5e-4)
    apart = []
    for k in range(len(line.layer)):
        frame = moved.frames[BODIES.layer_row[line.layer[k]]]
        pixel = CAMERA.project(frame[:, :3] @ line.point[k] + frame[:, 3])[0]
        same = (new.layer == line.layer[k]) & (new.across @ line.across[k] > 0.97)
        away = new.pixel[same] - pixel
        near = np.abs(away @ [-line.across[k][1], line.across[k][0]]) < 1.0
        near &= np.linalg.norm(away, axis=1) < 5.0
        if near.any():
            apart.append(np.min(np.abs(away[near] @ line.across[k])))
    assert len(apart) > 0.8 * len(line.layer)
    assert np.percentile(apart, 95) < 0.05  # px; the object moved by up to 1.5 px


@pytest.mark.parametrize("kind", ["raw", "log"])
@pytest.mark.parametrize("outline", [False, True])
def test_the_gradient_of_the_cost_is_the_numerical_one(kind, outline):
    if kind == "log" and outline:
        pytest.skip("outlines need raw images")
    templates, image = taken(kind)
    state = state_at(ANGLES_DEG + np.array([0.6, -0.8, 0.7, 0.5]))
    frame = frame_of(templates, image, state, level=0, outline=outline, background=EMPTY)
    rows = frame.linearise(state)
    gradient = -2.0 * rows.jacobian[:-1].T @ rows.error[:-1]
    order = frame.order

    def cost(step):
        frame.order = order
        rows = frame.linearise(PROCESS.retract(state, step))
        return float(rows.error @ rows.error)

    for column in (6, 7, 8, 9):
        step = np.zeros(20)
        step[column] = 2e-4
        numerical = (cost(step) - cost(-step)) / 4e-4
        # The noise depends on the image's gradient at the state; that part is left out of the Jacobian.
        assert abs(gradient[column] - numerical) < 0.15 * np.abs(gradient[6:10]).max()


@pytest.mark.parametrize("kind", ["raw", "log"])
def test_steps_lead_back_to_where_the_templates_were_taken(kind):
    templates, image = taken(kind)
    state = state_at(ANGLES_DEG + np.array([2.0, -2.0, 1.5, 2.0]))
    for level in (0, 1, 2, 2):
        rows = frame_of(templates, image, state, level).linearise(state)
        fixed = rows.jacobian[:, 6:10]
        step = np.zeros(20)
        step[6:10] = np.linalg.solve(fixed.T @ fixed, fixed.T @ rows.error)
        state = PROCESS.retract(state, step)
    np.testing.assert_allclose(np.degrees(state[ANGLES:ANGLES + 4]), ANGLES_DEG, atol=0.1)


def test_another_light_changes_nothing():
    templates, _ = taken()
    state, bright = state_at(), image_of(gain=1.15)
    rows = frame_of(templates, bright, state).linearise(state)
    fixed = rows.jacobian[:, 6:10]
    step = np.linalg.solve(fixed.T @ fixed, fixed.T @ rows.error)
    assert np.all(np.abs(np.degrees(step)) < 0.3)


def test_what_lies_behind_a_link_is_not_compared():
    templates, image = taken()
    crossing = state_at([25.0, 30.0, 30.0, 25.0])
    front, back = frame_of(templates, image, crossing), frame_of(templates, image, crossing, layered=False)
    front.linearise(crossing)
    back.linearise(crossing)
    assert np.all(front.used <= back.used)
    assert front.used.sum() < 0.9 * back.used.sum()


def test_a_template_outside_of_the_picture_says_so_and_tells_nothing():
    templates, image = taken()
    away = np.eye(4)
    away[:3, 3] = [3.0, 0.0, 0.0]
    state = state_at(root=away)
    frame = frame_of(templates, image, state)
    rows = frame.linearise(state)
    assert np.isfinite(rows.error).all()
    assert not frame.used.any()
    assert "outside of the picture" in frame.reasons[0]
    assert np.abs(rows.jacobian).max() < 0.01  # a regularisation of a thousandth of a standard deviation


def test_behind_the_camera_nothing_is_compared():
    templates, image = taken()
    behind = np.eye(4)
    behind[:3, 3] = 2.0 * CAMERA.centre
    state = state_at(root=behind)
    frame = frame_of(templates, image, state)
    assert np.isfinite(frame.linearise(state).error).all()
    assert not frame.used.any()


def test_a_link_without_texture_gives_no_template_and_says_why():
    image = np.full((300, 400, 3), 90, np.uint8)
    templates, placed = TemplateSet(), placed_at(state_at())
    labels = segment(BODIES, placed, visibility(BODIES, placed, RECORD).order, RECORD, RAYS)
    assert not templates.take(0, templates.images(image), labels, BODIES, placed, RECORD, RAYS, 1.0, True)
    assert "no contrast" in templates.refused[0]
    assert not templates.take(0, templates.images(image), np.full_like(labels, NONE), BODIES, placed, RECORD, RAYS, 1.0,
                              True)
    assert "outside of the picture" in templates.refused[0]
    assert not templates.templates


@pytest.mark.parametrize("kind", ["raw", "log"])
def test_the_noise_of_filtered_images_is_as_said(kind):
    noise = np.random.default_rng(0).normal(128.0, 4.0, (300, 300))
    image = np.repeat(np.clip(noise, 0.0, 255.0).astype(np.uint8)[:, :, None], 3, 2)
    for sigma in (1.0, 2.0):
        assert np.std(filtered(image, kind, sigma)) == pytest.approx(4.0 * noise_gain(kind, sigma), rel=0.08)
