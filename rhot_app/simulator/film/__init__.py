"""Simulated recordings: the scene's objects, their pictures and logs, the truth, and what ideal detectors see."""
