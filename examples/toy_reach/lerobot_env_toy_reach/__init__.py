"""What LeRobot imports at start: registers `--env.type=toy_reach`."""

import toy_reach.config  # noqa: F401
