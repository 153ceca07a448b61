"""Evaluation: `metrics` are read, `statistics` gives intervals, `comparison` and `report` make tables.

`soil_validation` holds the soil to published experiments, `fuzz` looks for impossible states, `soil_video` films a dig,
`speed` times this machine.
"""
