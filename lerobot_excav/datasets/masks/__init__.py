"""Masks for recorded pictures: of another source than the recording's own, or for a dataset that has none."""
