"""The joints of a network's points, from the master's part of its model card."""

from __future__ import annotations

from pathlib import Path

import pytest

from rhot_app.errors import RigError
from rhot_app.hand.landmarks import landmark_set
from rhot_app.hand.skeleton import JOINTS

CARD = """name = "other order"
licence = "MIT"
[network]
file = "n.onnx"
sha256 = "{hash}"
input_px = [64, 64]
[points]
count = {count}
sigma = 0.01
[anatomy]
joints = [{joints}]
"""


def card(folder: Path, joints: list[str], count: int) -> Path:
    path = folder / "other.toml"
    path.write_text(CARD.format(hash="0" * 64, count=count, joints=", ".join(f'"{joint}"' for joint in joints)))
    return path


def test_points_in_another_order_are_the_same_joints(tmp_path: Path) -> None:
    order = list(reversed(JOINTS))
    found = landmark_set(card(tmp_path, order, 21))
    assert found.ids == tuple(order)
    assert [marker.role for marker in found.markers] == [f"landmark_{joint}" for joint in order]


@pytest.mark.parametrize(("joints", "count", "says"), [
    (list(JOINTS), 20, "each of the 20 points"), ([*JOINTS[:-1], "elbow"], 21, "'elbow', which is no joint"),
    ([*JOINTS[:-1], "wrist"], 21, "'wrist', twice")])
def test_points_without_a_joint_are_refused(tmp_path: Path, joints: list[str], count: int, says: str) -> None:
    with pytest.raises(RigError, match=says):
        landmark_set(card(tmp_path, joints, count))
