"""Cameras for robots of anybody: one that others may look through, and one that delivers a mask of it."""
