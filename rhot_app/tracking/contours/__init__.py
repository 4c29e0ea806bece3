"""Tracking of a bare hand by the edges that nodes find on slices, and by its foreground."""
