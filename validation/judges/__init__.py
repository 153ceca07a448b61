"""What two public judges of LeRobot datasets say about ours, and why we let some of it stand."""
