"""Commands, and the masks that show them in a picture; importing this makes the oracle known."""

import lerobot_excav.envs.masks.oracle  # noqa: F401 - registers itself
