"""The inverse kinematics of the literature side by side, apart from the live path: `methods.solve` is the way in."""
