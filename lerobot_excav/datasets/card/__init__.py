"""The card of a dataset: what is in it, for whoever finds it."""
