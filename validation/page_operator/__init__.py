"""Does the way through the page cost success? The scripted operator's sticks, replayed by a gamepad in a browser."""
