"""Detection: image to marker observations. Pure functions and small state, no input or output."""
