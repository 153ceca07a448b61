"""Measurements of this machine and of the code; each module is run by `python -m bench.NAME`."""
