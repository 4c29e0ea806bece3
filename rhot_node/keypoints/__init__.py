"""Keypoints by a neural network that the user places on the node: a region of the image in, its points out."""
