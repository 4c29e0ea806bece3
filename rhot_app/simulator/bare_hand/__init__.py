"""The twin's bare hand: a skinned surface, its skin, and data sets of it for trackers without markers."""
