"""LeRobot plugin for robots that act on the place they are pointed at.

Map of the package; dependencies run from top to bottom:

- `errors`, `setting`: what all may use; they know nobody.
- `envs.constants`, `envs.soil`: deformable soil; knows nobody, and nothing of MuJoCo.
- `envs.machines`: bodies, control and cameras of the excavator and of the arm; they know no scene and no target.
- `envs.masks`: commands, and the sources that show them as masks.
- `envs.tasks`: what is to be done: one folder per task, their registry, and the environment that plays any of them.
- `envs.configs`: the environments as LeRobot's commands see them.
- `robots`, `teleoperators`: the same tasks as LeRobot devices.
- `datasets`: paired demonstrations, by what is done with them.
- `evaluation`: metrics, intervals, reports.
- `scripts`: the subcommands of `lerobot-excav`.
- `policies`: `mask_act`; imports LeRobot and the first line only.
- `plugin`: the one list of what is registered with LeRobot; only LeRobot imports it.

Importing this package registers the gym ids, such as `lerobot_excav/Scoop-v0`, and loads nothing heavy.
"""

import lerobot_excav.envs  # noqa: F401 - registers the gym ids
