"""Tracked objects: rigid bodies with tags or markers, other trackers' worlds, shapes, and contact with the hand."""
