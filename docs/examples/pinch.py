"""A pinch, cell by cell: open this file as a notebook (Jupytext, VS Code), or run it: python pinch.py LOG [FOLDER]."""

# %% A recording, tracked
import sys
from pathlib import Path

import numpy as np

from rhot_app.api import FINGERS, Knowledge, open_recording

log = Path(sys.argv[1])
folder = Path(sys.argv[2] if len(sys.argv) > 2 else ".")
recording = open_recording(log)
states = recording.states(tracker="estimator")
print(f"{len(states)} states in {states.times_s[-1]:.1f} s, tracked with the rig {recording.rig.name!r}")
for loss in recording.losses:
    print("could not be read:", loss)

# %% The distance of thumb and index, where the markers of both are measured
thumb, index = (states.fingertip_positions[:, FINGERS.index(finger)] for finger in ("thumb", "index"))
aperture_m = np.linalg.norm(index - thumb, axis=1)
markers = [states.marker_ids.index(name) for name in ("thumb", "index")]  # ids in the rig's marker set
measured = (states.marker_knowledge[:, markers] == Knowledge.MEASURED).all(axis=1) & states.tracked
print(f"both measured in {100 * measured.mean():.0f} % of the states: "
      f"{1e3 * aperture_m[measured].min():.0f} to {1e3 * aperture_m[measured].max():.0f} mm apart")

# %% How fast the index finger moves: at equal intervals, since a difference over 2 ms would be mostly noise
even = recording.states(tracker="estimator", rate_hz=40)
index = even.fingertip_positions[:, FINGERS.index("index")]
speed = np.linalg.norm(np.gradient(index, even.times_s, axis=0), axis=1)
print(f"the index fingertip moves at {np.nanpercentile(speed, 95):.2f} m/s or less in 95 % of the states")

# %% The same as a table
table = states.to_dataframe(units="mm")
print(table.loc[measured, ["time_s", "fingertip_index_x_mm", "angle_index_pip_flexion_deg"]].describe())

# %% And as files for other programs
for name in ("pinch.csv", "pinch.glb"):
    print(recording.export(folder / name, tracker="estimator", again=True).path)
