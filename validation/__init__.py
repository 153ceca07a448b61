"""Experiments that hold the simulation to published ones; not part of the wheel."""
