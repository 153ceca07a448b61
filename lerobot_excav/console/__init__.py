"""The console: a person sees a machine, points, drives, lets a policy work, and records."""
