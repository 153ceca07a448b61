"""How a dataset stores its pictures: as PNG in the table of frames, or as lossless video beside it.

LeRobot decodes every `image` column of every row of the action chunk that it loads for one sample: 13 ms of a core at a
chunk of 10 and 112 ms at a chunk of 100, with three pictures of 96 x 128. Videos are left alone there, and only the
sample's own pictures are decoded: 10 and 17 ms. So long chunks need videos, and a mask needs lossless ones.
"""

from typing import Any, Literal

from lerobot_excav.envs.masks.video import LOSSLESS_CODEC, LOSSLESS_PIX_FMTS, keeps_masks
from lerobot_excav.errors import DatasetError

Storage = Literal["image", "video"]
STORAGES: tuple[Storage, ...] = ("image", "video")


def require_lossless(key: str, info: dict[str, Any]) -> None:
    """Check that a video keeps pictures as they were, but for rounding of colours by 2 grey levels.

    Raises:
        DatasetError: It was compressed with losses, or its settings are unknown.
    """
    codec, crf, pix_fmt = (info.get(f"video.{name}") for name in ("codec", "crf", "pix_fmt"))
    if not keeps_masks(codec, crf, pix_fmt):
        raise DatasetError(
            f"{key}: dtype='video' with codec={codec!r}, crf={crf} and pix_fmt={pix_fmt!r}, which blurs the mask; "
            f"needed are codec={LOSSLESS_CODEC!r}, crf=0 and pix_fmt one of {', '.join(LOSSLESS_PIX_FMTS)}; record "
            "with --dataset.video=false, or with the encoder settings of docs/reference/schema.md"
        )
