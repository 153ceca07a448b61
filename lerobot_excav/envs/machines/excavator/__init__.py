"""An 8-t excavator at a worksite with soil and a target box."""
