"""The rig refined while it tracks: corrections of its cameras from what pairs of them observe."""
