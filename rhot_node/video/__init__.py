"""Video of a node's own frames, written beside the observations and kept until a master has fetched it."""
