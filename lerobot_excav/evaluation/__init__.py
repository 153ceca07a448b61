"""Evaluation: `metrics` are read, `statistics` gives intervals, `comparison` and `report` make tables.

What reports know of a task stands in `scoop_table` and `grasp_table`; `result_page` is the page of a whole experiment,
whose stages `experiment` runs.
`soil_validation` holds the soil to published experiments, `fuzz` looks for impossible states, `soil_video` films a dig,
`speed` times this machine.
"""
