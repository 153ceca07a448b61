"""The Fairino FR5 arm grasping one of four blocks: work cell, scenes, task and scripted operator."""
