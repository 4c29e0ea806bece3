"""A node as a system service: the unit, its installation, and what the daemon tells the service manager."""
