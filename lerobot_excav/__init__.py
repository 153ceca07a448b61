"""LeRobot plugin for robots that act on the place they are pointed at.

Map of the package; dependencies run from top to bottom:

- `envs.soil`: deformable soil, knows nothing of MuJoCo.
- `envs.excavator`: machine, scenes, targets, task and scripted operator.
- `robots`, `teleoperators`: the same machine as LeRobot devices.
- `datasets`: paired demonstrations, their schema and their index.
- `evaluation`: metrics, intervals and reports; validation, fuzz and film of the soil.
- `scripts`: the subcommands of `lerobot-excav`.
- `policies`: `mask_act`; imports LeRobot only.
- `plugin`: the one list of what is registered with LeRobot.

Importing this package imports nothing heavy.
"""
