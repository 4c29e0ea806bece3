"""Bone lengths and marker places of a hand that moves."""
