"""What a Python program imports, and the programs that docs/api.md and docs/examples show."""

from __future__ import annotations

import itertools
import re
import runpy
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from patience import PATIENCE_S
from stereo_pictures import BOARD, FOLDER, needs_pictures

from rhot_app import api
from rhot_app.export.states import HandStates
from rhot_app.recording.raw_log import LogReader
from rhot_node.files import resource_path

DOCS = Path(__file__).parents[2] / "docs"


def test_a_recording_is_tracked_as_an_engine_would(log: Path, states: HandStates) -> None:
    recording = api.open_recording(str(log))
    found = recording.states("classic")
    assert np.array_equal(found.joint_positions, states.joint_positions, equal_nan=True)
    assert found.conditions == states.conditions and recording.losses == ()
    assert recording.rig == LogReader(log).rig
    with pytest.raises(api.ExportError, match="only the estimator smooths"):
        recording.states("classic", smooth=True)


def test_smoothed_states(log: Path, states_by: Callable[[str], HandStates], tmp_path: Path) -> None:
    filtered, recording = states_by("estimator"), api.open_recording(log)
    found = recording.states("estimator", smooth=True)
    assert len(found) == pytest.approx(len(filtered), abs=2) and (np.diff(found.t_master_ns) >= 0).all()
    assert (np.diff(found.sequence) == 1).all()
    spread = [np.nanmedian(np.trace(one.fingertip_covariances, axis1=2, axis2=3)) for one in (filtered, found)]
    assert spread[1] < 0.8 * spread[0]
    frame = recording.to_dataframe("estimator", rate_hz=25.0, units="m", smooth=True)
    done = recording.export(tmp_path / "a.csv", tracker="estimator", rate_hz=25.0, units="m", smooth=True)
    assert len(frame) == pytest.approx(45, abs=2) and done.states == len(found)


def test_states_at_a_rate(log: Path, states: HandStates) -> None:
    found = api.open_recording(log).states("classic", rate_hz=25.0)
    assert np.diff(found.t_master_ns) == pytest.approx(4e7)
    known = found.tracked
    inner = np.isfinite(states.angles[:, 6])
    assert found.angles[known, 6] == pytest.approx(
        np.interp(found.times_s[known], states.times_s[inner], states.angles[inner, 6]), abs=1e-6)


def test_another_rig_and_the_losses_of_a_torn_log(log: Path, tmp_path: Path) -> None:
    torn = tmp_path / "torn.rhotlog"
    torn.write_bytes(log.read_bytes()[:-1000])
    api.save_rig(tmp_path / "rig.json", LogReader(log).rig)
    recording = api.open_recording(torn, tmp_path / "rig.json")
    frame = recording.to_dataframe("classic", units="m")
    assert 50 < len(frame) < 72 and frame["joint_wrist_z_m"].max() < 1.0
    (loss,) = recording.losses
    assert "torn" in loss
    done = recording.export(tmp_path / "a.npz", tracker="classic")
    assert done.losses == (loss,) and done.states == len(frame)
    with pytest.raises(api.RigError, match="no such file"):
        api.open_recording(log, tmp_path / "no.json")


def test_a_running_engine_is_followed(log: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "rhot_app", "replay", str(log), "--keep", "--directory", str(tmp_path / "e")]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as engine:
        assert engine.stderr is not None and any("for clients" in line for line in engine.stderr)
        states = list(itertools.islice(api.live(tmp_path / "e", patience_s=30.0), 20))
        engine.send_signal(signal.SIGTERM)
        assert engine.wait(PATIENCE_S) == 0
    assert all(isinstance(state, api.HandState) for state in states)
    assert np.all(np.diff([state.t_master_ns for state in states]) > 0)


def test_no_engine_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(api.EngineError, match="no engine is heard"):
        next(api.live(tmp_path / "nobody", patience_s=0.3))


@needs_pictures
def test_cameras_are_put_together_from_pictures() -> None:
    pictures = {name: [FOLDER / f"{name}{number:02d}.jpg" for number in range(1, 9)] for name in ("left", "right")}
    rig = api.load_rig(resource_path("rigs", "two_pis.json"))
    result = api.calibrate_stereo(pictures, BOARD, rig)
    assert result.rig is not None and "rms" in result.summary
    assert result.rig.nodes[1].pose.translation_m[0] == pytest.approx(0.0998, abs=1e-3)
    with pytest.raises(api.CalibrationError, match="no camera called middle"):
        api.calibrate_stereo({"left": pictures["left"], "middle": pictures["right"]}, BOARD, rig)


PLOT = '''"""Stands in for matplotlib: notes what is drawn."""
import json


def plot(x, y):
    print(json.dumps([len(x), len(y), max(v for v in y if v == v)]))


def xlabel(text): pass


def ylabel(text): pass


def show(): print("shown")
'''


def test_the_ten_lines_of_the_page(log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                   capsys: pytest.CaptureFixture[str]) -> None:
    found = re.search(r"```python\n(.*?)```", (DOCS / "api.md").read_text(), re.DOTALL)
    assert found is not None and len([line for line in found[1].splitlines() if line]) <= 13
    (tmp_path / "matplotlib").mkdir()
    (tmp_path / "matplotlib" / "__init__.py").write_text("")
    (tmp_path / "matplotlib" / "pyplot.py").write_text(PLOT)
    (tmp_path / "take.rhotlog").write_bytes(log.read_bytes())
    for name in [name for name in sys.modules if name.partition(".")[0] == "matplotlib"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)
    exec(found[1], {})
    drawn, shown = capsys.readouterr().out.splitlines()
    times, values, fastest = map(float, drawn.strip("[]").split(","))
    assert shown == "shown" and times == values > 60
    assert 0.02 < fastest < 1.0, "m/s; a difference over the few ms between two cameras is noise"


def test_the_example_file(log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                          capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["pinch.py", str(log), str(tmp_path)])
    runpy.run_path(str(DOCS / "examples" / "pinch.py"), run_name="__main__")
    said = capsys.readouterr().out
    assert "both measured in" in said and "fingertip_index_x_mm" in said
    assert {"pinch.csv", "pinch.glb"} <= {path.name for path in tmp_path.iterdir()}


def test_damage_in_the_middle_of_a_log_is_named_and_the_rest_is_exported(log: Path, tmp_path: Path) -> None:
    damaged = tmp_path / "damaged.rhotlog"
    data = bytearray(log.read_bytes())
    data[len(data) // 2] ^= 0xFF
    damaged.write_bytes(data)
    recording = api.open_recording(damaged)
    states = recording.states()
    (loss,) = recording.losses
    assert "1 damaged place was skipped" in loss
    assert len(states.times_s) > 0.9 * len(api.open_recording(log).states().times_s)
