"""Evaluation: the whole system, from rendered images to published states, compared with the truth it never saw."""
