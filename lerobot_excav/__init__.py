"""LeRobot plugin for robots that act on the place they are pointed at.

Map of the package; each part may use those above it:

- `errors`, `loopback`, `run_lock`, `setting`, `whole_file`: what all may use; they know nobody else.
- `envs.constants`, `envs.holder`, `envs.plugins`: numbers of every simulation; the running command's configuration;
  tasks and mask sources of other packages.
- `envs.soil`: deformable soil; knows nothing of MuJoCo.
- `envs.machines`: bodies, control and cameras of the excavator and of the arm; they know no scene and no target.
- `envs.masks`: commands, and the sources that show them as masks.
- `envs.tasks`: what is to be done: one folder per task, their registry, and the environment that plays any of them.
- `envs.configs`: the environments as LeRobot's commands see them.
- `testbed`: a machine behind a wire, its safety, and an emulator of it.
- `cameras`: cameras for any robot: a shared one, the mask of it, and pictures that come over the network.
- `page`: the web page on which a person sees, points and drives; knows no policy and no dataset.
- `robots`, `teleoperators`: the same tasks, and the test bed, as LeRobot devices.
- `datasets`: paired demonstrations, by what is done with them.
- `evaluation`: metrics, intervals, reports.
- `console`: the page at work: a policy that digs, a person who takes over and records.
- `scripts`: the subcommands of `lerobot-excav`.
- `policies`: `mask_act`; imports LeRobot and the first line only.
- `plugin`: the one list of what is registered with LeRobot; only LeRobot imports it.

Importing this package registers the gym ids, such as `lerobot_excav/Scoop-v0`, and loads nothing heavy.
"""

import lerobot_excav.envs  # noqa: F401 - registers the gym ids
