"""Inverse kinematics: what the trackers solve hands with, and the literature's solvers, which a rig may choose."""
