"""The record of the tests' own wizard, which stands in no module of the app."""

from rhot_app.calibration.registry import Calibration

SAMPLE = Calibration("sample", "Sample", "A small wizard.", "lens calibration")
