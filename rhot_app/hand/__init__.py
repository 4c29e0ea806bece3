"""The hand: anatomy, kinematics, limits, inverse kinematics. Palm frame: see `skeleton`."""
