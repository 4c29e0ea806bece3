"""Objects beside the hand: other trackers' worlds, shapes of objects, and contact with them."""
