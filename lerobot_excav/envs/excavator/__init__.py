"""The excavator: machine, scenes, targets, task and scripted operator."""
