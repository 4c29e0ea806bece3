"""Simulated cameras and nodes: real daemons, live pictures and bad networks."""
