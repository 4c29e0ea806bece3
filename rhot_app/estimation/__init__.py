"""Recursive estimation on manifolds: residuals, Gauss-Markov processes, an iterated filter and a smoother.

Nothing here knows hands or cameras.
"""
