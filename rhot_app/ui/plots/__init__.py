"""The plots at the bottom of the window: one class per plot on a common panel with pause, reset and copy."""
