"""Everything that this package registers with LeRobot.

| kind | `--<kind>.type` | here |
|---|---|---|
| environment | `excavator` | `ExcavatorEnvConfig` |
| policy | `mask_act` | `MaskACTConfig` |
| robot | `excavator_sim` | `ExcavatorSimConfig` |
| teleoperator | `excavator_joystick` | `ExcavatorJoystickConfig` |
| teleoperator | `excavator_operator` | `ExcavatorOperatorConfig` |

Importing a configuration registers it. LeRobot finds the class that belongs to it when a command needs it,
so no simulator is loaded here.
"""

from lerobot_excav.envs.configuration_excavator import ExcavatorEnvConfig
from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.teleoperators.excavator_joystick.config_excavator_joystick import ExcavatorJoystickConfig
from lerobot_excav.teleoperators.excavator_operator.config_excavator_operator import ExcavatorOperatorConfig

__all__ = [
    "ExcavatorEnvConfig",
    "ExcavatorJoystickConfig",
    "ExcavatorOperatorConfig",
    "ExcavatorSimConfig",
    "MaskACTConfig",
]
