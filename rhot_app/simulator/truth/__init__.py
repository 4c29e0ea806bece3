"""What really happened in a simulated run, and what ideal detectors see of it."""
