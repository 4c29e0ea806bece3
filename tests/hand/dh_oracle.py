"""The plain numpy twin of the tree kinematics: 4x4 products from a file's rows, and numerical differentiation."""

import numpy as np


def rotation(axis, angle):
    """(4, 4) turn about z or x."""
    c, s = np.cos(angle), np.sin(angle)
    turn = {"z": [[c, -s, 0], [s, c, 0], [0, 0, 1]], "x": [[1, 0, 0], [0, c, -s], [0, s, c]]}[axis]
    out = np.eye(4)
    out[:3, :3] = turn
    return out


def shift(x=0.0, y=0.0, z=0.0):
    """(4, 4) translation."""
    out = np.eye(4)
    out[:3, 3] = x, y, z
    return out


def root_transform(state):
    """(4, 4) of a state's first seven numbers, by Hamilton's product."""
    w, x, y, z = np.asarray(state[:4]) / np.linalg.norm(state[:4])
    left = np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]])
    right = np.array([[w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w]])
    return shift(*state[4:7]) @ (left @ right.T)[np.ix_([1, 2, 3, 0], [1, 2, 3, 0])]


def frames_of(document, state):
    """name -> (4, 4) of the root and every frame of a right-sided file (Rehg eq. 2.2), lengths in m."""
    angles = {angle.name: value for angle, value in zip(document.angles, state[7:], strict=True)}
    frames = {document.root.name: root_transform(state)}
    for frame in document.frames:
        theta = np.radians(frame.theta_deg) + frame.sign * angles.get(frame.angle, 0.0)
        frames[frame.name] = (frames[frame.parent] @ rotation("z", theta) @ shift(z=1e-3 * frame.d_mm)
                              @ shift(x=1e-3 * frame.a_mm) @ rotation("x", np.radians(frame.alpha_deg)))
    return frames


def points_of(document, state):
    """(P, 3) m."""
    frames = frames_of(document, state)
    return np.array([(frames[point.frame] @ [*(1e-3 * np.array(point.offset_mm)), 1.0])[:3]
                     for point in document.points]).reshape(-1, 3)


def jacobian_of(points, state, step=1e-6):
    """(P, 3, N): central differences of a function of the state."""
    columns = [(points(state + step * unit) - points(state - step * unit)) / (2 * step) for unit in np.eye(len(state))]
    return np.stack(columns, axis=-1)
