"""The bare hand: its surface, its contours in images, and a tracker without markers."""
