"""Filters over many channels at once."""
