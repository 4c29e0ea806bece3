"""Depth from disparity without a board, from a marker at known distances."""
