"""Colours of the paint, learnt from pictures."""
