"""Simulated cameras and nodes: films, live pictures, logs and bad networks."""
