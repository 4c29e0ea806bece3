"""One hand as the state of an iterated extended Kalman filter, and the residuals that tell about it."""
