"""Robust bundle adjustment: the one solver of lens, board and stereo calibrations."""
