"""FR5Grasp-v0: the arm puts the commanded block, and no other, into the tray."""
