"""From observations to a hand state: pairing in time, the trackers, and the state they produce."""
