"""Scoop-v0: one dig-load-dump cycle of the excavator on a commanded region."""
