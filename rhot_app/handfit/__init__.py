"""Interactive fitting of a hand's shape and pose to pictures of calibrated cameras (Rehg 1995, 2.2.3). No Qt."""
