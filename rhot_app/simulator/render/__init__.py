"""From a scene to the pictures of a camera.

Two renderers: rays against solids here, triangles for a bare hand (`rhot_app.simulator.bare_hand.rasterise`). Triangles
are as true and eight times as slow (benchmarks/renderers.py).
"""
