"""The mask source `vlm_dig` in the list of sources; importing this makes it known."""

from lerobot_excav.envs.masks.source import MaskSource, register_mask_source
from lerobot_excav.envs.tasks.planner.vlm_options import VlmDigOptions


def _make(options: VlmDigOptions) -> MaskSource:
    # Loaded only now, so that commands can list the sources quickly.
    from lerobot_excav.envs.tasks.planner.vlm_dig import VlmDigSource

    return VlmDigSource(options)


register_mask_source("vlm_dig", _make, options=VlmDigOptions, chooses=True)
