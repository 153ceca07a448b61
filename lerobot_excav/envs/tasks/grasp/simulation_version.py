"""The version of the arm's simulation; what counts as a change is said in `envs.excavator.simulation_version`.

Each environment counts its own, so that a change of the soil makes no recording of the arm unusable.
"""

SIMULATION_VERSION = 1
"""What this package simulates, written into every dataset, session log and metrics file."""

CHANGES = {1: "the first: servos at their speed limits, four blocks, a tray with a rim"}
"""What each version is, or changed."""
