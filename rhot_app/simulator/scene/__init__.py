"""What stands before the simulated cameras, and how it moves."""
