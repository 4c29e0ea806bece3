"""Files of labelled points at a fixed rate: TRC (OpenSim) and C3D (motion capture). Layout and axes: docs/export.md."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from rhot_app.errors import ExportError, require
from rhot_app.export.frames import Axes, file_from_frame, frame_up
from rhot_app.export.plan import Format, Plan
from rhot_app.export.states import HandStates, hands_of, hidden_where_lost
from rhot_app.hand.skeleton import ANGLES, FINGERS, JOINTS
from rhot_app.project import OTHER_HAND
from rhot_node.errors import printable

C3D_FRAMES_MAX: Final = 65534
"""A last frame of 65535 says that the number stands elsewhere; py-c3d then reads no frame, ezc3d none after that."""

C3D_TEXT_MAX: Final = 255
"""Bytes of a parameter's text, whose length is one byte."""

Array = NDArray[np.float64]
Compact = NDArray[np.float32]


def labels(states: HandStates) -> tuple[str, ...]:
    """Names of the points, in the order of `points_of`: joints, fingertips and markers."""
    found: list[str] = []
    for prefix in hands_of(states):
        found += [f"{prefix}{joint}" for joint in JOINTS]
        found += [f"{prefix}{finger}_fingertip" for finger in FINGERS]
    return (*found, *(f"marker_{marker}" for marker in states.marker_ids))


def points_of(states: HandStates) -> tuple[Array, Array]:
    """(N, P, 3) m positions, NaN while the hand is not tracked, and the standard deviation of each, (N, P) m: the root
    of the mean variance of its axes, NaN where it is not estimated."""
    positions: list[Array] = []
    covariances: list[Array] = []
    for hand in hands_of(states).values():
        positions += [hidden_where_lost(hand.joint_positions, hand), hidden_where_lost(hand.fingertip_positions, hand)]
        covariances += [hand.joint_covariances, hand.fingertip_covariances]
    positions.append(states.marker_positions)
    covariances.append(states.marker_covariances)
    variances = np.trace(np.concatenate(covariances, axis=1), axis1=2, axis2=3) / 3.0
    return np.concatenate(positions, axis=1), np.sqrt(variances)


class _Points:
    """Keeps the points of a recording, 32-bit, in the file's units and axes."""

    def __init__(self, plan: Plan, axes: Axes) -> None:
        self.notes: list[str] = []
        self.labels: tuple[str, ...] = ()
        self._plan = plan
        self._turn = plan.scale * file_from_frame(frame_up(plan.rig.up, plan.frame), axes)
        self._positions: list[Compact] = []
        self._deviations: list[Compact] = []
        self._angles: list[Compact] = []

    def add(self, states: HandStates) -> None:
        """Keep these states."""
        self.labels = self.labels or labels(states)
        positions, deviations = points_of(states)
        self._positions.append((positions @ self._turn.T).astype(np.float32))
        self._deviations.append((self._plan.scale * deviations).astype(np.float32))
        self._angles.append(np.degrees(np.concatenate(
            [np.where(hand.present[:, None], hand.angles, np.nan) for hand in hands_of(states).values()],
            axis=1)).astype(np.float32))

    def close(self) -> None:
        """Let go of the points."""
        self._positions, self._deviations, self._angles = [], [], []

    @property
    def rate_hz(self) -> float:
        """Of the frames."""
        assert self._plan.rate_hz is not None
        return self._plan.rate_hz


class TrcWriter(_Points):
    """Tab-separated text as OpenSim reads and writes it: y up; a gap is three cells of NaN. OpenSim refuses a row whose
    last cell is empty."""

    def __init__(self, plan: Plan) -> None:
        super().__init__(plan, "y-up")

    def finish(self) -> None:
        """Write the file."""
        count, rate = sum(map(len, self._positions)), f"{self.rate_hz:g}"
        head = [f"PathFileType\t4\t(X/Y/Z)\t{printable(self._plan.log)}",
                "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
                f"{rate}\t{rate}\t{count}\t{len(self.labels)}\t{self._plan.units}\t{rate}\t1\t{count}",
                "Frame#\tTime\t" + "\t\t\t".join(self.labels) + "\t\t",
                "\t\t" + "\t".join(f"{axis}{point}" for point in range(1, len(self.labels) + 1) for axis in "XYZ"),
                ""]
        with self._plan.path.open("w", encoding="utf-8", newline="") as file:
            file.write("\n".join(head) + "\n")
            file.writelines(self._lines())

    def _lines(self) -> Iterator[str]:
        number = 0
        places = "%.4f" if self._plan.units == "mm" else "%.7f"
        line = "%d\t%.6f\t" + "\t".join([places] * (3 * len(self.labels))) + "\n"
        for block in self._positions:
            for row in block.reshape(len(block), -1).tolist():
                yield (line % (number + 1, number / self.rate_hz, *row)).replace("nan", "NaN")
                number += 1


class C3dWriter(_Points):
    """Binary, floating point: z up; a gap has residual -1; angles are analog channels in degrees.

    A point's residual is its standard deviation, 0 where the tracker estimates none.
    """

    def __init__(self, plan: Plan) -> None:
        self._ezc3d = require("ezc3d", "a C3D file")
        super().__init__(plan, "z-up")
        self._count = 0

    def add(self, states: HandStates) -> None:
        """Keep these states. Raises ExportError when a C3D file cannot hold so many."""
        self._count += len(states)
        if self._count > C3D_FRAMES_MAX:
            longest_s = C3D_FRAMES_MAX / self.rate_hz
            longest = f"{longest_s / 60.0:.1f} minutes" if longest_s >= 120.0 else f"{longest_s:.1f} s"
            raise ExportError(f"{self._plan.log} is too long for C3D, whose readers count to {C3D_FRAMES_MAX} frames: "
                              f"{longest} at {self.rate_hz:g} Hz. Give a lower --rate, or take another format.")
        super().add(states)

    def finish(self) -> None:
        """Write the file."""
        file = self._ezc3d.c3d()
        hands = len(self._angles[0][0]) // len(ANGLES)
        channels = tuple(f"{prefix}{angle}" for prefix in ("", OTHER_HAND)[:hands] for angle in ANGLES)
        self._describe(file, channels)
        points, residuals = self._homogeneous()
        file["data"]["points"] = points
        file["data"]["meta_points"]["residuals"] = residuals
        file["data"]["analogs"] = np.concatenate(self._angles).T[None].astype(np.float64)
        expected = 4 * (points.size + sum(map(np.size, self._angles)))
        del points, residuals
        self.close()
        try:
            file.write(str(self._plan.path))
        except RuntimeError as exc:
            raise ExportError(f"{self._plan.path}: ezc3d could not write it ({exc}).") from exc
        if self._plan.path.stat().st_size < expected:  # ezc3d does not notice a full disk
            raise OSError(28, "No space left on device")

    def _describe(self, file: object, channels: tuple[str, ...]) -> None:
        parameters = file["parameters"]  # type: ignore[index]
        parameters["POINT"]["RATE"]["value"] = [self.rate_hz]
        parameters["POINT"]["UNITS"]["value"] = [self._plan.units]
        parameters["POINT"]["LABELS"]["value"] = self.labels
        parameters["POINT"]["DESCRIPTIONS"]["value"] = tuple(_description(label) for label in self.labels)
        parameters["ANALOG"]["RATE"]["value"] = [self.rate_hz]
        parameters["ANALOG"]["LABELS"]["value"] = channels
        parameters["ANALOG"]["UNITS"]["value"] = ("deg",) * len(channels)
        file.add_parameter("POINT", "X_SCREEN", ["+X"])  # type: ignore[attr-defined]
        file.add_parameter("POINT", "Y_SCREEN", ["+Z"])  # type: ignore[attr-defined]
        for key, value in self._plan.about().items():
            text = (value or "unknown").encode()[:C3D_TEXT_MAX].decode(errors="ignore")
            file.add_parameter("RHOT", key.upper(), [text])  # type: ignore[attr-defined]

    def _homogeneous(self) -> tuple[Array, Array]:
        """(4, P, N) positions and (1, P, N) residuals as ezc3d takes them."""
        positions = np.concatenate(self._positions)
        points = np.ones((4, positions.shape[1], len(positions)))
        points[:3] = positions.transpose(2, 1, 0)
        residuals = np.nan_to_num(np.concatenate(self._deviations).T[None].astype(np.float64))
        residuals[0, np.isnan(points[0])] = -1.0
        return points, residuals


def _description(label: str) -> str:
    return "marker" if label.startswith("marker_") else "fingertip" if label.endswith("_fingertip") else "joint"


FORMATS = (
    Format("trc", "TRC: points, for OpenSim", TrcWriter, (".trc",), "mm", uniform=True),
    Format("c3d", "C3D: points, motion capture", C3dWriter, (".c3d",), "mm", uniform=True))
