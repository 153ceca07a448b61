"""`mask_act`: LeRobot's ACT, pointed at its target by a mask of the main camera.

Importing this package registers `--policy.type=mask_act`. LeRobot itself finds `MaskACTPolicy` in `modeling_mask_act`
and the processors in `processor_mask_act`, by name, when a policy is built.
"""

from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig

__all__ = ["MaskACTConfig"]
