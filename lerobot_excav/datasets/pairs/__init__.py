"""The paired-scene index, and what is chosen and held out by it."""
