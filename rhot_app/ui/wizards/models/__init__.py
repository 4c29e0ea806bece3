"""What the wizards know and decide, without Qt."""
