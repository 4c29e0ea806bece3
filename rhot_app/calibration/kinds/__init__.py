"""The calibrations, a file each: what it collects, solves, says, proposes and when it is stale. See `registry`."""
