"""Clear-v0: dig a pile away, cycle by cycle, where a planner points."""
