"""Calibration boards: printed, drawn, and found in pictures."""
