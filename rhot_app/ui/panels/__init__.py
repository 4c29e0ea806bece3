"""The panels around the scene: one widget per file."""
