"""The certificate of a rig: chapter 7 of the RHOT thesis repeated by its user. Collect, solve, judge, report."""
