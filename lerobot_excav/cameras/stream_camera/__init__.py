"""A camera whose pictures come over the network."""
