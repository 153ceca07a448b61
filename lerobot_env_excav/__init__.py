"""Discovery shim: LeRobot imports distributions named `lerobot_env_*`; this import registers the plugin."""

import lerobot_excav.plugin  # noqa: F401
