"""Evaluation: `metrics` are read, `statistics` gives intervals, `comparison` and `report` make tables.

What is measured of a task stands with the task, in its `measures`; `result_page` is the page of a whole experiment.
`soil_validation` holds the soil to published experiments, `fuzz` looks for impossible states, `soil_video` films a dig,
`speed` times this machine.
"""
