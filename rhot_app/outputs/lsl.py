"""Lab Streaming Layer: one stream of float32 channels per hand, with the time of every state."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from rhot_app.errors import OutputError
from rhot_app.outputs.joints import HandSample, Sample
from rhot_app.project import OutputSettings

_AXES = ("x", "y", "z")
_TURNS = ("qx", "qy", "qz", "qw")


class LslSink:
    """An outlet per hand, made when the hand is first reported."""

    def __init__(self, settings: OutputSettings) -> None:
        """Nothing is opened yet."""
        self._name = settings.target or "RHOT"
        self._lsl: Any = None
        self._outlets: dict[str, Any] = {}

    def open(self) -> None:
        """Load the library; raises OutputError naming what is missing."""
        try:
            import pylsl
        except ImportError as exc:
            raise OutputError("LSL needs the package pylsl, RHOT's extra lsl: "
                              "`.venv/bin/python -m pip install pylsl`.") from exc
        except (RuntimeError, OSError) as exc:  # pylsl found no liblsl
            raise OutputError("LSL needs the library liblsl, which pip does not bring on Linux: install a liblsl "
                              "package of https://github.com/sccn/liblsl/releases, or let PYLSL_LIB name the file "
                              "liblsl.so, and start again.") from exc
        self._lsl = pylsl

    def write(self, sample: Sample) -> None:
        """Push one state, stamped with the instant that it describes; a replayed one with now."""
        now_s = self._lsl.local_clock()
        stamp_s = now_s if np.isnan(sample.age_s) else now_s - 1e-9 * (time.monotonic_ns() - sample.state.t_master_ns)
        for hand in sample.hands:
            outlet = self._outlets.get(hand.name)
            if outlet is None:
                outlet = self._outlets[hand.name] = self._outlet(sample, hand)
            outlet.push_sample(channels(hand), stamp_s)

    def close(self) -> None:
        """Withdraw the streams."""
        self._outlets = {}

    def _outlet(self, sample: Sample, hand: HandSample) -> Any:
        names = channel_names(sample, hand)
        info = self._lsl.StreamInfo(f"{self._name} {hand.name}", "MoCap", len(names), 0.0, self._lsl.cf_float32,
                                    f"rhot {self._name} {hand.name} {sample.joint_set}")
        # Readers that know another clock: LSL has its own, and its stamps cannot be of the wall clock.
        info.desc().append_child_value("unix_minus_lsl_s", f"{time.time() - self._lsl.local_clock():.6f}")
        listed = info.desc().append_child("channels")
        for name in names:
            quantity = name.rpartition("_")[2]
            unit = "metres" if quantity in (*_AXES, "radius") else ""
            channel = listed.append_child("channel")
            kind = "Knowledge" if quantity == "knowledge" else "Pose"
            for key, value in (("label", name), ("unit", unit), ("type", kind)):
                channel.append_child_value(key, value)
        return self._lsl.StreamOutlet(info)


def channel_names(sample: Sample, hand: HandSample) -> list[str]:
    """Joint by joint: position, orientation and radius where the joint set has them, knowledge."""
    parts = (*_AXES, *(() if hand.orientations is None else (*_TURNS, "radius")), "knowledge")
    return [f"{joint}_{part}" for joint in sample.joints for part in parts]


def channels(hand: HandSample) -> list[float]:
    """The values of `channel_names`; what is unknown is NaN."""
    columns = [hand.positions]
    if hand.orientations is not None and hand.radii is not None:
        columns += [hand.orientations, hand.radii[:, None]]
    values: list[float] = np.hstack([*columns, hand.knowledge[:, None]]).ravel().tolist()
    return values
