"""A progress bar that counts episodes and tells their rate."""

import time
from typing import Any

from tqdm import tqdm


class EpisodeProgress:
    """Counts finished episodes on a bar, unless it is not to be shown."""

    def __init__(self, total: int, *, show: bool) -> None:
        self._bar: tqdm[Any] = tqdm(
            total=total,
            disable=not show,
            desc="episodes",
            bar_format="{desc} {n_fmt}/{total_fmt} |{bar}| {elapsed}<{remaining}{postfix}",
        )
        self._start = time.monotonic()
        self._counted = 0
        self._failed = 0

    def __enter__(self) -> "EpisodeProgress":
        return self

    def __exit__(self, *exception: object) -> None:
        self._bar.close()

    def count(self, *, success: bool) -> None:
        """Count an episode that has just been finished."""
        self._counted += 1
        self._failed += not success
        minutes = max(time.monotonic() - self._start, 1e-6) / 60.0
        text = f"{self._counted / minutes:.1f} episodes/min, {self._failed} without success"
        self._bar.set_postfix_str(text, refresh=False)
        self._bar.update()

    def skip(self) -> None:
        """Count an episode that was finished before."""
        self._bar.update()
