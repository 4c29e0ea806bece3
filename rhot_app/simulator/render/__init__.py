"""From a scene to the pictures of a camera."""
