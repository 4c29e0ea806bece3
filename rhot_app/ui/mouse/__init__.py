"""The page of the 3-D mouse: its scene and its window."""
