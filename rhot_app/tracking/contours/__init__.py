"""Tracking by what nodes find in their images: the edges of a bare hand on slices, and its foreground."""
