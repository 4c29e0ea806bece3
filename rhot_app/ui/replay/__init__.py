"""Recordings on the screen: the library of logs, and a log tracked once and played back state by state."""
