"""Camera settings (RHOT 7.1): what each camera is told, tried out live, with a way back. No Qt."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import msgspec

from rhot_app.project import RigNode
from rhot_app.ui.wizards.models.proposal import Row
from rhot_node.config import CameraSettings

Value = float | None


@dataclass(frozen=True, slots=True)
class Control:
    """One setting: its field in `CameraSettings`, its name, what it does. `low`..`high` is what the slider covers, in
    units of the field divided by `scale`; typed numbers may go to `most`. `optional`: it may be left to the camera."""

    field: str
    name: str
    meaning: str
    low: float
    high: float
    most: float
    neutral: float
    unit: str = ""
    scale: float = 1.0
    decimals: int = 2
    optional: bool = True
    logarithmic: bool = False
    least: float = 0.0


CONTROLS: tuple[Control, ...] = (
    Control("exposure_us", "Exposure time", "How long each row collects light. Short keeps moving markers sharp; a "
            "multiple of the mains' half period (10 ms at 50 Hz, 8.33 ms at 60 Hz) keeps lamps from flickering.",
            0.1, 33.0, 1000.0, 4.0, unit=" ms", scale=1000.0, optional=False, logarithmic=True, least=0.01),
    Control("gain", "Gain", "Amplifies the signal, and its noise. Raise it only when light and exposure cannot be.",
            1.0, 16.0, 1000.0, 1.0, logarithmic=True, least=0.01),
    Control("brightness", "Brightness", "Added to every pixel. 0 leaves it; it brings no light, so change it last.",
            -1.0, 1.0, 255.0, 0.0, least=-255.0),
    Control("contrast", "Contrast", "Spreads the grey levels about the middle; 1 leaves them.",
            0.0, 4.0, 255.0, 1.0, least=0.0),
    Control("saturation", "Saturation", "How strong colours are; 1 leaves them, more sets the markers apart from grey.",
            0.0, 4.0, 255.0, 1.0, least=0.0),
    Control("red_gain", "Red gain", "White balance: raise it when white looks green or blue.",
            0.2, 8.0, 1000.0, 1.0, logarithmic=True, least=0.01),
    Control("blue_gain", "Blue gain", "White balance: raise it when white looks yellow or red.",
            0.2, 8.0, 1000.0, 1.0, logarithmic=True, least=0.01),
)


class CameraChoices:
    """The settings of all cameras: as they were, and as they are being tried out; the way back step by step."""

    def __init__(self, nodes: tuple[RigNode, ...], node_settings: dict[int, dict[str, Any]]) -> None:
        """`node_settings` by node id, as the nodes gave them; cameras whose node gave none cannot be set."""
        self.nodes = tuple(node for node in nodes if node.node_id in node_settings)
        self.before = {node.node_id: msgspec.convert(node_settings[node.node_id]["camera"], CameraSettings)
                       for node in self.nodes}
        self.now = dict(self.before)
        self._undone: list[dict[int, CameraSettings]] = []

    def value(self, node_id: int, control: Control) -> Value:
        """A camera's setting in the control's unit; None when it is left to the camera."""
        value = getattr(self.now[node_id], control.field)
        return None if value is None else float(value) / control.scale

    def change(self, node_ids: tuple[int, ...], control: Control, value: Value, *, goes_on: bool = False) -> None:
        """Tell these cameras another value; `goes_on`: a slider is still moving, one step back undoes it whole.

        Raises ValueError, in the words of the settings' own check, for a value that cannot be.
        """
        raw = None if value is None else value * control.scale
        changed = dict(self.now)
        for node_id in node_ids:
            fields = msgspec.to_builtins(self.now[node_id]) | {control.field: raw}
            changed[node_id] = msgspec.convert(fields, CameraSettings)
        if changed != self.now:
            if not goes_on or not self._undone:
                self._undone.append(self.now)
            self.now = changed

    def undo(self) -> bool:
        """One step back."""
        if not self._undone:
            return False
        self.now = self._undone.pop()
        return True

    @property
    def undoable(self) -> bool:
        """Whether there is a step back."""
        return bool(self._undone)

    def whole(self, node_id: int, *, before: bool = False) -> dict[str, Any]:
        """All of a camera's settings, as a node is told them: now, or as they were."""
        return {"camera": msgspec.to_builtins((self.before if before else self.now)[node_id])}

    @property
    def changed(self) -> tuple[RigNode, ...]:
        """Cameras whose settings are others now."""
        return tuple(node for node in self.nodes if self.now[node.node_id] != self.before[node.node_id])

    def differences(self, node_id: int) -> tuple[dict[str, Any], dict[str, Any]]:
        """The node settings that differ, before and now."""
        old, new = (msgspec.to_builtins(settings[node_id]) for settings in (self.before, self.now))
        fields = [field for field in new if new[field] != old[field]]
        return {"camera": {field: old[field] for field in fields}}, {"camera": {field: new[field] for field in fields}}

    def rows(self, nodes: tuple[RigNode, ...]) -> tuple[Row, ...]:
        """Every setting of these cameras before and after."""
        return tuple(
            Row(f"{node.name}: {control.name.lower()}", value_text(control, self.before[node.node_id]),
                value_text(control, self.now[node.node_id]))
            for node in nodes for control in CONTROLS)


def value_text(control: Control, settings: CameraSettings) -> str:
    """A setting with its unit, in words when it is left to the camera."""
    value = getattr(settings, control.field)
    if value is None:
        return "left to the camera"
    return f"{float(value) / control.scale:.{control.decimals}f}{control.unit}"
