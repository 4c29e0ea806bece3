"""The bare hand: observations without markers, and trackers by them."""
