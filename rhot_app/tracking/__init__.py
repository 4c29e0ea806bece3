"""From observations to hand states: pairing in time, association, and the trackers."""
