"""The window in which a hand is fitted to pictures."""
