"""Evaluation: `metrics` reads what was measured, `statistics` gives intervals, `comparison` and `report` make tables."""
