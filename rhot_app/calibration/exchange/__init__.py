"""Calibrations of other programs: their files read into one record of a camera, and written from it."""
