"""The estimator of a hand with markers: what it measures, how it starts, how large the hand is, what it reports."""
