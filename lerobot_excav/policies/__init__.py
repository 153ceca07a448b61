"""Policies that LeRobot finds by `--policy.type`.

This package imports nothing but its subpackages' configurations when they are asked for: a policy's network is
loaded by LeRobot, by name, when a policy is built.
"""
