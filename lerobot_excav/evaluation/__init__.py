"""Evaluation: `metrics` are read, `statistics` gives intervals, `comparison` and `report` make tables."""
