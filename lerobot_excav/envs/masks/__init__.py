"""Commands, and the masks that show them in a picture; importing this makes the sources of this package known."""

import lerobot_excav.envs.masks.click.source
import lerobot_excav.envs.masks.geometry
import lerobot_excav.envs.masks.grounded_sam
import lerobot_excav.envs.masks.manual
import lerobot_excav.envs.masks.oracle  # noqa: F401 - they register themselves
