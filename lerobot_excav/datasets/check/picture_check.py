"""Whether every picture of an episode can be decoded, and shows something."""

from collections.abc import Iterator

from lerobot_excav.datasets.format.episode_table import EpisodeTable
from lerobot_excav.datasets.format.schema import MASK_KEY
from lerobot_excav.errors import DatasetError


def picture_problems(episode: EpisodeTable) -> Iterator[str]:
    """Decode every picture; describe in plain words the first of each camera that is damaged or of one colour.

    A scene is lit and shaded, so only a mask may be of one colour.
    """
    for key in episode.pictures:
        try:
            yield from _camera_problems(episode, key)
        except DatasetError as damage:
            yield f"{key}: {damage}"


def _camera_problems(episode: EpisodeTable, key: str) -> Iterator[str]:
    for frame, img in enumerate(episode.pictures[key].frames()):
        colour = img[0, 0]
        if key != MASK_KEY and (img == colour).all():
            yield f"{key}: the picture of frame {frame} shows nothing: every pixel is {tuple(colour.tolist())}"
            return
