"""The target planner: where an excavator could dig next, from what is seen of the soil."""
