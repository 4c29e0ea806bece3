"""The core has one damped descent in Python and one compiled one, beside those of the solvers that are compared."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def test_no_other_loop_damps_its_steps():
    found = subprocess.run([sys.executable, "benchmarks/descents.py"], cwd=ROOT, capture_output=True, text=True,
                           check=True).stdout
    cells = [line.strip("| ").split("|") for line in found.splitlines()[2:] if line.startswith("|")]
    damped = {(file.strip(), function.strip()) for file, function in cells}
    shared = {function for file, function in damped if file == "rhot_app/estimation/least_squares.py"}
    assert shared == {"minimise", "descend"}
    compared = {"rhot_app/hand/solvers/inverse.py", "rhot_app/hand/solvers/newton.py"}
    assert {file for file, _ in damped} - compared == {"rhot_app/estimation/least_squares.py"}
