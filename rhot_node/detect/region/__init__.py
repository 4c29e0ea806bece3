"""How one blob of a marker colour is measured: its coverage, its outline, its centroid with covariance."""
