"""Policies that LeRobot finds by `--policy.type`.

Importing a subpackage registers its configuration; LeRobot loads the network, by name, when it builds a policy.
"""
