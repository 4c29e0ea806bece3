"""What runs behind the window, without Qt: the engine and nodes that the app started or attached to, and their data."""
