"""A camera whose pictures a mask camera may look at."""
