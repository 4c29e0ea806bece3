"""The raw log of all datagrams, written and read."""
