"""What all windows share: their theme, shapes, remembered settings, guide, workers, and the controller of the app."""
