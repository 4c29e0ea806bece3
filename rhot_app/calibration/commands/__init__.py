"""One file per calibration: its command line, what it reports and what it proposes for the rig."""
