"""What runs behind the window, without Qt: the engine and the nodes that the app started or attached to, and their data."""
