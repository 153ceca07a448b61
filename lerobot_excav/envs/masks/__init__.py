"""Commands, and the masks that show them in a picture."""
