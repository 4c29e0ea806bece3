"""Articulated objects in images: visibility order, layered templates, a small tracker (Rehg 1995, chapters 2, 3)."""
