"""Machines with their bodies, control and cameras; they know no scene, no target and no task."""
