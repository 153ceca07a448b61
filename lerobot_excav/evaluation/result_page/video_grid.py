"""Rollouts side by side: the videos of `lerobot-eval`, in which the target is marked, as tiles of one small video.

Words say which row of the page a row of tiles is, and how each episode ended.
"""

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import PIL.Image

from lerobot_excav.datasets.format.reading import reading
from lerobot_excav.envs.tasks.measures import EpisodeRecord
from lerobot_excav.errors import DatasetError
from lerobot_excav.evaluation.result_page.contents import Clips
from lerobot_excav.evaluation.result_page.page import PageRow, ResultPage
from lerobot_excav.evaluation.result_page.words import strip
from lerobot_excav.evaluation.video import Image, read_video, write_video

logger = logging.getLogger(__name__)

MAX_BYTES = 1_500_000
"""What a video in a repository may weigh."""

FRAMES_PER_SECOND = 25
SUCCESS_RGB, OBEYED_RGB, FAILURE_RGB = (60, 180, 75), (40, 110, 235), (128, 128, 128)

_TILE_HEIGHT = 192
_BORDER = 4
_QUALITIES = (26, 30, 34, 38, 42)  # constant rate factors of x264, from good to coarse


@dataclass(frozen=True, kw_only=True)
class Clip:
    """A tile of the grid: the video of an episode, and the record that colours its border."""

    path: Path
    episode: EpisodeRecord


@dataclass(frozen=True, kw_only=True)
class GridRow:
    """Tiles beside each other, and what they are of."""

    about: str
    clips: Sequence[Clip]


def grid_rows(page: ResultPage) -> list[GridRow]:
    """Return the clips of a page whose videos are there, row by row.

    Raises:
        DatasetError: A video is of an episode that was not played.
    """
    rows = {row.row.label: row for row in page.rows}
    return [
        GridRow(
            about=rows[clips.label].row.about,
            clips=[_clip(page, rows[clips.label], number) for number in clips.episodes],
        )
        for clips in present_clips(page)
    ]


def present_clips(page: ResultPage) -> list[Clips]:
    """Return what the video grid of a page can show: its contents without the episodes whose videos are not there."""
    rows = {row.row.label: row for row in page.rows}
    present = [
        clips.model_copy(
            update={"episodes": tuple(n for n in clips.episodes if _video(page, rows[clips.label], n).is_file())}
        )
        for clips in page.contents.clips
        if clips.label in rows
    ]
    return [clips for clips in present if clips.episodes]


def _video(page: ResultPage, row: PageRow, number: int) -> Path:
    """Return the video of an episode of a row's first evaluation, as `lerobot-eval --output_dir=FOLDER` calls it."""
    name, evaluation, _ = row.parts[0]
    videos = page.contents.videos
    folder = evaluation.path.parent if videos is None else Path(videos) / name
    return next(iter(sorted(folder.glob(f"videos/*/eval_episode_{number}.mp4"))), folder / "none")


def _clip(page: ResultPage, row: PageRow, number: int) -> Clip:
    # In the order in which they were played, as the videos are numbered.
    played = list(row.run.first.episodes.values())
    if number >= len(played):
        raise DatasetError(
            f"clips of {row.row.label!r}: episode {number} was not played; {row.run.first.path} has episodes 0 to "
            f"{len(played) - 1}"
        )
    return Clip(path=_video(page, row, number), episode=played[number])


def write_grid(path: Path, rows: Sequence[GridRow]) -> None:
    """Write rows of clips as one mp4, in real time, as fine as `MAX_BYTES` allows; warn if the coarsest weighs more.

    Shorter clips stand still at their end. The border of a tile and the mark before its words are green if its episode
    succeeded, blue if the machine did what the shown mask said, which was not the command, and grey otherwise.
    """
    pictures = _grid_pictures(rows)
    for quality in _QUALITIES:
        write_video(path, pictures, FRAMES_PER_SECOND, crf=quality)
        if path.stat().st_size <= MAX_BYTES:
            return
    logger.warning(
        f"{path} weighs {path.stat().st_size} bytes, more than {MAX_BYTES}; show fewer clips, or shorter ones"
    )


def _grid_pictures(rows: Sequence[GridRow]) -> list[Image]:
    tiles = [[_tiles(clip) for clip in row.clips] for row in rows]
    length = max(len(clip) for row in tiles for clip in row)
    width = max(sum(clip[0].shape[1] for clip in row) for row in tiles)
    words = [(strip(row.about, width), _outcomes(row.clips, clips)) for row, clips in zip(rows, tiles, strict=True)]
    return [
        np.concatenate(
            [
                part
                for (about, outcomes), clips in zip(words, tiles, strict=True)
                for part in (
                    about,
                    _band([clip[min(i, len(clip) - 1)] for clip in clips], width),
                    _band(outcomes, width),
                )
            ]
        )
        for i in range(length)
    ]


def _outcomes(clips: Sequence[Clip], tiles: Sequence[Sequence[Image]]) -> list[Image]:
    """Return the strips below tiles."""
    return [
        strip(clip.episode.outcome_words, pictures[0].shape[1], colour=_border_rgb(clip.episode))
        for clip, pictures in zip(clips, tiles, strict=True)
    ]


def _band(pictures: Sequence[Image], width: int) -> Image:
    """Put pictures beside each other, and black to their right."""
    band = np.concatenate(pictures, axis=1)
    return np.pad(band, ((0, 0), (0, width - band.shape[1]), (0, 0)))


def _tiles(clip: Clip) -> list[Image]:
    """Return the pictures of a clip at the grid's size and rate, framed."""
    ticks_per_frame = FRAMES_PER_SECOND / _rate(clip.path)
    colour = _border_rgb(clip.episode)
    tiles: list[Image] = []
    for number, image in enumerate(read_video(clip.path)):
        # A frame is seen at the grid's ticks until the next one begins: at several, or at none.
        ticks = math.ceil((number + 1) * ticks_per_frame) - len(tiles)
        if ticks:
            tiles += ticks * [framed(resized(image), colour)]
    return tiles


def _border_rgb(episode: EpisodeRecord) -> tuple[int, int, int]:
    if episode.is_success:
        return SUCCESS_RGB
    return OBEYED_RGB if episode.obeyed_shown_mask else FAILURE_RGB


def _rate(path: Path) -> Fraction:
    with reading(path), av.open(str(path)) as container:
        return Fraction(container.streams.video[0].average_rate)


def resized(image: Image) -> Image:
    """Return a picture as high as a tile, in its own proportions; a small one keeps its sharp pixels."""
    height, width = image.shape[:2]
    size = (2 * round(0.5 * width * _TILE_HEIGHT / height), _TILE_HEIGHT)  # codecs want even numbers
    method = PIL.Image.Resampling.NEAREST if height < _TILE_HEIGHT else PIL.Image.Resampling.LANCZOS
    return np.array(PIL.Image.fromarray(image).resize(size, method))


def framed(image: Image, colour: tuple[int, int, int]) -> Image:
    """Return a picture whose border has a colour."""
    result = image.copy()
    for edge in (result[:_BORDER], result[-_BORDER:], result[:, :_BORDER], result[:, -_BORDER:]):
        edge[...] = colour
    return result
