"""What every wizard is made of: window, frame, pages, pictures, movements and long work."""
