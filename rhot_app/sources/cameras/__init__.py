"""Cameras of this computer: webcams, network cameras, films and folders of pictures, each behind a node of its own."""
