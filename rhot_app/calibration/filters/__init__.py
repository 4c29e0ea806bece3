"""The 1-euro filters' parameters, from a hand at rest and one that moves."""
