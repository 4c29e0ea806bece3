"""Where observations come from: UDP nodes with their clocks, and replayed logs through the same door."""
