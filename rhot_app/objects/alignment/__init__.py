"""Aligns the world of another tracker with the rig, from two streams of one motion, and watches that it stays so."""
