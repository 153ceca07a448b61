"""What stands between a mask source and what is shown: the errors and the mending that the settings ask for."""

from lerobot_excav.envs.masks.corrupted import CorruptedSource
from lerobot_excav.envs.masks.snapped import SnappedSource
from lerobot_excav.envs.masks.source import MaskSource
from lerobot_excav.envs.tasks.settings import TaskSettings

type ShownSource = CorruptedSource | SnappedSource
"""Makes masks as they are shown, for a command and at its frames."""


def shown_source(source: MaskSource, settings: TaskSettings, *, may_snap: bool = True) -> ShownSource:
    """Return a source under the condition and with the noise of some settings, and snapped if they say so.

    What a person has painted is shown as it is: `may_snap` is false.
    """
    corrupted = CorruptedSource(
        source,
        condition=settings.mask_condition,
        noise=settings.mask_noise,
        noise_px=settings.mask_noise_px,
        dropout=settings.mask_dropout,
    )
    return SnappedSource(corrupted) if settings.mask_snap and may_snap else corrupted
