"""21 landmarks of bare hands by the two hand networks of MediaPipe, which are installed by a command."""
