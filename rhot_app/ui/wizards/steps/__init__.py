"""The steps of each wizard without widgets: what they ask for, collect and find."""
