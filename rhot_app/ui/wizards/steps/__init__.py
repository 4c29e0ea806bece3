"""The steps of large wizards without widgets: what they ask for, collect and find."""
