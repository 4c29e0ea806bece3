"""The bare hand: what is observed of it without markers, and trackers of that."""
