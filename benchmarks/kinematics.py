"""What moving the whole hand costs: forward kinematics, its Jacobian, the state with a quaternion, OpenXR's joints.

    python benchmarks/kinematics.py [--seconds S] [--json FILE]

prints processor time per call, as the median of batches: of a call from Python with its arrays at hand, as the solvers'
callers make it, and within compiled code, as the solvers do; how many times faster the first is than the plain numpy
twin of the tests; and the largest difference between the two, and from central differences.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numba import njit
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "hand"))

from dh_oracle import frames_of, jacobian_of, points_of
from tables import arguments, publish, table

from rhot_app.hand.anatomy import load_hand
from rhot_app.hand.articulated import articulated_hand, load_articulated
from rhot_app.hand.articulated_model import (
    STATE_ROOT,
    ArticulatedModel,
    build_articulated,
    forward_state,
    forward_state_arrays,
    state_jacobian,
    state_jacobian_arrays,
)
from rhot_app.hand.dh import DhArrays
from rhot_app.hand.kinematics import TWIST, empty_frames, forward_arrays, jacobian_arrays
from rhot_app.hand.model import build_model
from rhot_app.outputs.openxr import OPENXR_JOINTS, openxr_arrays, openxr_map
from rhot_node.files import resource_path

Array = NDArray[np.float64]

TARGET_US = 15.0
BATCH = 200


def lever_jacobian(document, state):
    """(P, 3, 6 + A) for the root's translation, its turns about world axes and the angles, by cross products."""
    frames = frames_of(document, state)
    angles = [angle.name for angle in document.angles]
    rows = {frame.name: frame for frame in document.frames}
    out = np.zeros((len(document.points), 3, 6 + len(angles)))
    for jacobian, point, at in zip(out, document.points, points_of(document, state), strict=True):
        jacobian[:, :3] = np.eye(3)
        jacobian[:, 3:6] = np.cross(np.eye(3), at - frames[document.root.name][:3, 3]).T
        frame = rows.get(point.frame)
        while frame is not None:
            if frame.angle is not None:
                parent = frames[frame.parent]
                axis = frame.sign * parent[:3, 2]
                jacobian[:, 6 + angles.index(frame.angle)] += np.cross(axis, at - parent[:3, 3])
            frame = rows.get(frame.parent)
    return out


@dataclass(frozen=True)
class Cost:
    """Microseconds per call: from Python, within compiled code, of the numpy twin (NaN: there is none)."""

    name: str
    python_us: float
    compiled_us: float
    numpy_us: float


@njit(cache=True)
def _both(dh: DhArrays, root: Array, angles: Array, frames: Array, points: Array, out: Array) -> None:
    forward_arrays(dh, root, angles, frames, points)
    jacobian_arrays(dh, root, frames, points, out)


@njit(cache=True)
def _both_of_state(dh: DhArrays, state: Array, root: Array, frames: Array, points: Array, out: Array) -> None:
    forward_state_arrays(dh, state, root, frames, points)
    state_jacobian_arrays(dh, state, root, frames, points, out)


@njit(cache=True)
def _repeat_hand(count: int, dh: DhArrays, root: Array, angles: Array, frames: Array, points: Array,
                 out: Array) -> None:
    for _ in range(count):
        angles[0] += 1e-9  # so that no work can be left out
        _both(dh, root, angles, frames, points, out)


@njit(cache=True)
def _repeat_state(count: int, dh: DhArrays, state: Array, root: Array, frames: Array, points: Array,
                  out: Array) -> None:
    for _ in range(count):
        state[7] += 1e-9
        _both_of_state(dh, state, root, frames, points, out)


def per_call_us(call: Callable[[], object], seconds: float, batch: int = BATCH) -> float:
    """Processor time, median over batches for about so many seconds, after a first call that compiles."""
    call()
    times = []
    end = time.perf_counter() + seconds
    while time.perf_counter() < end or len(times) < 3:
        start = time.process_time()
        for _ in range(batch):
            call()
        times.append((time.process_time() - start) / batch)
    return 1e6 * float(np.median(times))


def hand_cost(seconds: float) -> Cost:
    """21 joints and 5 markers, 27 columns."""
    anatomy = load_hand(resource_path("hands", "right.json"))
    dh, document = build_model(anatomy).dh, articulated_hand(anatomy)
    state = build_articulated(document).rest
    root, angles = np.eye(4), state[STATE_ROOT:].copy()
    frames, points = empty_frames(dh), np.empty((len(dh.point_row), 3))
    out = np.empty((len(points), 3, TWIST + len(angles)))
    arrays = (dh, root, angles, frames, points, out)
    return Cost("hand: forward and Jacobian (26 points, 27 columns)",
                per_call_us(lambda: _both(*arrays), seconds),
                per_call_us(lambda: _repeat_hand(BATCH, *arrays), seconds, 5) / BATCH,
                per_call_us(lambda: lever_jacobian(document, state), seconds, 3))


def state_cost(name: str, model: ArticulatedModel, seconds: float) -> Cost:
    """All points of an object, a column for each state number."""
    state, root = model.rest.copy(), np.eye(4)
    frames, points = empty_frames(model.dh), np.empty((len(model.dh.point_row), 3))
    out = np.empty((len(points), 3, len(state)))
    arrays = (model.dh, state, root, frames, points, out)
    return Cost(f"{name}: forward and Jacobian ({len(points)} points, {len(state)} columns)",
                per_call_us(lambda: _both_of_state(*arrays), seconds),
                per_call_us(lambda: _repeat_state(BATCH, *arrays), seconds, 5) / BATCH,
                per_call_us(lambda: lever_jacobian(model.document, model.rest), seconds, 3))


def openxr_cost(seconds: float) -> Cost:
    """26 poses from the frames that the tracker has anyway."""
    model = build_model(load_hand(resource_path("hands", "right.json")))
    mapping, frames, world = openxr_map(model), empty_frames(model.dh), np.eye(4)
    forward_arrays(model.dh, world, np.zeros(21), frames, np.empty((len(model.dh.point_row), 3)))
    positions, orientations = np.empty((len(OPENXR_JOINTS), 3)), np.empty((len(OPENXR_JOINTS), 4))
    return Cost("hand: 26 OpenXR joints from its frames",
                per_call_us(lambda: openxr_arrays(mapping, world, frames, positions, orientations), seconds),
                float("nan"), float("nan"))


def error_inflation(model: ArticulatedModel) -> tuple[float, float, float]:
    """Largest difference of frames and points (m) from numpy's, and of the Jacobian from numpy's and from central
    differences (m per state number), over 20 random states."""
    rng = np.random.default_rng(0)
    worst = np.zeros(3)
    for _ in range(20):
        state = np.concatenate([rng.normal(size=4), rng.uniform(-0.5, 0.5, 3), rng.uniform(*model.limits.T)])
        posed, jacobian = forward_state(model, state), state_jacobian(model, state)
        frames = frames_of(model.document, state)
        expected = np.array([frames[name][:3] for name in model.row_names])
        numerical = jacobian_of(lambda moved: forward_state(model, moved).points, state)
        here = (max(np.abs(posed.frames - expected).max(),
                    np.abs(posed.points - points_of(model.document, state)).max()),
                np.abs(jacobian[:, :, STATE_ROOT:] - lever_jacobian(model.document, state)[:, :, TWIST:]).max(),
                np.abs(jacobian - numerical).max())
        worst = np.maximum(worst, here)
    return float(worst[0]), float(worst[1]), float(worst[2])


def main() -> int:
    """Measure, print the table, write JSON when asked; exit code 1 when the hand misses its target."""
    parser = arguments(__doc__)
    parser.add_argument("--seconds", type=float, default=1.0, help="for each figure")
    args = parser.parse_args()
    digiteyes = build_articulated(load_articulated(resource_path("hands", "digiteyes.json")))
    costs = [hand_cost(args.seconds), state_cost("digiteyes", digiteyes, args.seconds), openxr_cost(args.seconds)]
    worst = error_inflation(digiteyes)
    publish(args, {"costs": [asdict(cost) for cost in costs], "target_us": TARGET_US, "worst": worst},
            table(["processor time, µs per call", "called from Python", "inside compiled code", "plain numpy"],
                  [list(asdict(cost).values()) for cost in costs]),
            f"The largest difference of `digiteyes` from the numpy twin is {worst[0]:.1e} m. Its Jacobian differs by "
            f"{worst[1]:.1e} from the twin's, and by {worst[2]:.1e} from central differences.")
    return 0 if costs[0].python_us <= TARGET_US else 1


if __name__ == "__main__":
    sys.exit(main())
