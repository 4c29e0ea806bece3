"""Markers from frame to frame: where each is expected, and the contour that is fitted to it."""
