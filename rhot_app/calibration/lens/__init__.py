"""Lenses: intrinsics from views of a board."""
