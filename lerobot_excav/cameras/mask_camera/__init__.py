"""A camera that delivers the target mask of a shared camera."""
