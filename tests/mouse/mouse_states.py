"""Hand states of a known hand at the mouse: palm down, fingers forward, with the parts that a test moves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from shipped_rig import LEFT_MODEL, RIGHT_MODEL

from rhot_app.hand.kinematics import forward
from rhot_app.hand.skeleton import ANGLES, JOINTS, HandPose
from rhot_app.state import LATENCY_STAGES, UNESTIMATED, Condition, HandState, Knowledge

PERIOD_NS = 10_000_000
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""World from palm at rest: x right, y forward, z up, as the cursor's frame."""


def hand_state(number: int, place=(0.0, 0.0, 0.0), *, side: str = "right", unseen=(), tip_sd_m: float = 0.0,
               **angles_deg: float) -> HandState:
    """State `number` of a hand whose palm is at `place` m; `unseen`: joints that are guessed."""
    angles = np.zeros(len(ANGLES))
    for name, value in ({"index_mcp_flexion": 25.0} | angles_deg).items():
        angles[ANGLES.index(name)] = np.radians(value)
    palm = np.eye(4)
    palm[:3, :3], palm[:3, 3] = TURN, place
    points = forward(RIGHT_MODEL if side == "right" else LEFT_MODEL, HandPose(palm, angles))
    known = np.array([Knowledge.GUESSED if name in unseen else Knowledge.INFERRED for name in JOINTS], np.uint8)
    estimated = UNESTIMATED | ({"fingertip_covariances": np.tile(tip_sd_m**2 * np.eye(3), (5, 1, 1)),
                                "palm_covariance": np.zeros((6, 6))} if tip_sd_m else {})
    return HandState(
        sequence=number, t_master_ns=PERIOD_NS * number, t_receive_ns=PERIOD_NS * number, condition=Condition.TRACKING,
        marker_ids=(), marker_positions=np.zeros((0, 3)), marker_raw_positions=np.zeros((0, 3)),
        marker_covariances=np.zeros((0, 3, 3)), marker_knowledge=np.zeros(0, np.uint8), camera_names=(),
        camera_pixels=np.zeros((0, 0, 2)), camera_flags=np.zeros((0, 0), np.uint16), joint_positions=points.joints,
        joint_knowledge=known, fingertip_positions=points.marker_centres, angles=angles,
        angle_knowledge=np.zeros(21, np.uint8), world_from_palm=palm, palm_knowledge=Knowledge.INFERRED,
        epipolar_error_px=np.zeros(0), **estimated, latency_s=dict.fromkeys(LATENCY_STAGES, 1e-4))


def lost(number: int) -> HandState:
    """State `number` without a hand."""
    unknown = np.full(21, Knowledge.UNKNOWN, np.uint8)
    return replace(hand_state(number), condition=Condition.LOST, world_from_palm=np.full((4, 4), np.nan),
                   joint_knowledge=unknown, joint_positions=np.full((21, 3), np.nan))


REST = 60
"""States after which every part of the hand has been at rest for long enough."""

SPREAD = {"thumb": {"thumb_cmc_flexion": -25.0}, "little": {"little_mcp_abduction": -30.0}}
"""What presses each button."""
