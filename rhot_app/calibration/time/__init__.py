"""Time offsets between cameras, from a marker that moves."""
