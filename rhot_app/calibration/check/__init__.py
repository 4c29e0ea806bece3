"""What a rig and its cameras can be checked for before anything moves."""
