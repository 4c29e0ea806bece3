"""How a hand moves: a Gauss-Markov process on its pose, and the part of the pose that markers do not show."""
