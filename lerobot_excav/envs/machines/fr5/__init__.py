"""A Fairino FR5 arm with a two-finger gripper in a work cell with blocks and a tray."""
