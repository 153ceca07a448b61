"""Environments. Importing this package registers every task of the registry with Gymnasium, and nothing else."""

import lerobot_excav.envs.tasks.registry  # noqa: F401 - registers the tasks
