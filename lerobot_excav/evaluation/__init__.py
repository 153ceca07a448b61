"""Evaluation: `metrics` are read, `statistics` gives intervals, `comparison` and `report` make tables.

What is measured of a task stands with the task, in its `measures`; `result_page` is the page of a whole experiment,
`operator_run` evaluates the scripted operator, and `speed` times this machine.
"""
