"""The kinds of observations: for each, one file with all that the master knows of its messages.

To add one: a class that derives from `kind.Kind`, in a file of its own here, and a line in `registry.KINDS`; or in
another package, which calls `registry.register`. Its message is in `rhot_node/wire`, or another kind's. What it
observes of a hand are residuals on the hand's state (`tracker.HandFrame`), which every estimator takes.
"""
