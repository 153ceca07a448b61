"""From a click to a mask, by a small network that looks at pixels alone."""
