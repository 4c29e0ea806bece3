"""Frames, the camera model, triangulation, rolling-shutter time."""
