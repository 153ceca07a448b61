"""The quality check of a dataset."""
