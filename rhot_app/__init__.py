"""The master: triangulates what the nodes see, solves the hand, serves it to the screen and to other programs."""
