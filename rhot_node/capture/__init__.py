"""Cameras: everything that can deliver frames to a node. One file per backend, one interface (`camera.Camera`)."""
