"""Everything that this package registers with LeRobot.

| kind | `--<kind>.type` | here |
|---|---|---|
| environment | `excavator` | `ExcavatorEnvConfig` |
| environment | `fr5_grasp` | `FR5GraspEnvConfig` |
| policy | `mask_act` | `MaskACTConfig` |
| robot | `excavator_sim` | `ExcavatorSimConfig` |
| robot | `fr5_sim` | `FR5SimConfig` |
| camera | `shared` | `SharedCameraConfig` |
| camera | `stream` | `StreamCameraConfig` |
| robot | `excavator_testbed` | `ExcavatorTestbedConfig` |
| camera | `mask` | `MaskCameraConfig` |
| teleoperator | `excavator_joystick` | `ExcavatorJoystickConfig` |
| teleoperator | `excavator_keyboard` | `ExcavatorKeyboardConfig` |
| teleoperator | `excavator_operator` | `ExcavatorOperatorConfig` |
| teleoperator | `excavator_web` | `ExcavatorWebConfig` |
| teleoperator | `fr5_operator` | `FR5OperatorConfig` |
| teleoperator | `fr5_web` | `FR5WebConfig` |

Importing a configuration registers it. LeRobot finds the class that belongs to it when a command needs it,
so no simulator is loaded here.
"""

from lerobot_excav.cameras.mask_camera.config_mask_camera import MaskCameraConfig
from lerobot_excav.cameras.shared_camera.config_shared_camera import SharedCameraConfig
from lerobot_excav.cameras.stream_camera.config_stream_camera import StreamCameraConfig
from lerobot_excav.envs.configs.excavator import ExcavatorEnvConfig
from lerobot_excav.envs.configs.fr5_grasp import FR5GraspEnvConfig
from lerobot_excav.envs.plugins import load_plugins
from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.excavator_testbed.config_excavator_testbed import ExcavatorTestbedConfig
from lerobot_excav.robots.fr5_sim.config_fr5_sim import FR5SimConfig
from lerobot_excav.teleoperators.excavator_joystick.config_excavator_joystick import ExcavatorJoystickConfig
from lerobot_excav.teleoperators.excavator_keyboard.config_excavator_keyboard import ExcavatorKeyboardConfig
from lerobot_excav.teleoperators.excavator_operator.config_excavator_operator import ExcavatorOperatorConfig
from lerobot_excav.teleoperators.excavator_web.config_excavator_web import ExcavatorWebConfig
from lerobot_excav.teleoperators.fr5_operator.config_fr5_operator import FR5OperatorConfig
from lerobot_excav.teleoperators.fr5_web.config_fr5_web import FR5WebConfig

__all__ = [
    "ExcavatorEnvConfig",
    "ExcavatorJoystickConfig",
    "ExcavatorKeyboardConfig",
    "ExcavatorOperatorConfig",
    "ExcavatorSimConfig",
    "ExcavatorTestbedConfig",
    "ExcavatorWebConfig",
    "FR5GraspEnvConfig",
    "FR5OperatorConfig",
    "FR5SimConfig",
    "FR5WebConfig",
    "MaskACTConfig",
    "MaskCameraConfig",
    "SharedCameraConfig",
    "StreamCameraConfig",
]

# Tasks and mask sources of other packages, for the commands that find this one.
load_plugins()
