"""The calibrations that a wizard alone can do: their pages stand in `rhot_app.ui.wizards`, by these names."""

from rhot_app.calibration.registry import Calibration

CAMERA = Calibration(
    "camera", "Set the cameras", "Exposure, gains, white balance: what each camera is told, tried out live.",
    "camera settings")
FOREGROUND = Calibration(
    "foreground", "Background and skin", "What the empty scene and your skin look like, so that a bare hand can be "
    "tracked.", "background and skin")
