"""What the steps of all wizards share, without Qt."""
