"""A picture that tells what a dataset is about: a start with all its targets, side by side."""

from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from PIL import Image

from lerobot_excav.datasets.format.episode_table import EpisodeTable, iterate_episodes
from lerobot_excav.datasets.format.schema import MASK_KEY, camera_key
from lerobot_excav.datasets.pairs.pair_coverage import start_columns
from lerobot_excav.envs.masks.overlay import tinted

MAIN_KEY = camera_key("main")

STARTS = 2
"""Starts in the picture, one below the other (kind: guess)."""

WIDTH_PX = 1024
"""Width of the picture (kind: guess; GitHub and the Hub show 800 to 1000)."""


def contact_sheet(root: Path, index: pd.DataFrame) -> Image.Image:
    """Return the first views of the episodes of the best paired starts, their masks tinted, a start per row.

    Args:
        root: The dataset.
        index: Its paired-scene index.

    Raises:
        DatasetError: A picture is damaged.
    """
    rows = [list(episodes) for episodes in _best_paired(index)]
    wanted = {episode for row in rows for episode in row}
    tables = iterate_episodes(root, [MAIN_KEY, MASK_KEY], episodes=wanted)
    views = {table.index: _view(table) for table in tables}
    empty = np.full_like(next(iter(views.values())), 255)
    columns = max(map(len, rows))
    padded = [[*(views[episode] for episode in row), *[empty] * (columns - len(row))] for row in rows]
    sheet = Image.fromarray(np.vstack([np.hstack(row) for row in padded]))
    scale = WIDTH_PX / sheet.width
    return sheet.resize((WIDTH_PX, round(scale * sheet.height)), Image.Resampling.LANCZOS)


def _best_paired(index: pd.DataFrame) -> list[list[int]]:
    """Return the episodes of the starts with the most targets, by target; of equals the first."""
    once = index.drop_duplicates([*start_columns(index), "target_id"]).sort_values("target_id")
    starts = [rows["episode_index"].tolist() for _, rows in once.groupby(start_columns(index))]
    return sorted(starts, key=lambda episodes: (-len(episodes), min(episodes)))[:STARTS]


def _view(table: EpisodeTable) -> NDArray[np.uint8]:
    return tinted(table.image(MAIN_KEY, 0), table.image(MASK_KEY, 0)[..., 0] > 127)
