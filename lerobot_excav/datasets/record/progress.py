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
        self._written = 0

    def __enter__(self) -> "EpisodeProgress":
        return self

    def __exit__(self, *exception: object) -> None:
        self._bar.close()

    def count(self, *, success: bool) -> None:
        """Count an episode that has just been finished."""
        self._counted += 1
        self._failed += not success
        self._tell(refresh=False)
        self._bar.update()

    def skip(self) -> None:
        """Count an episode that was finished before."""
        self._bar.update()

    def count_written(self) -> None:
        """Count an episode that is now in the dataset; with videos this takes minutes longer than playing."""
        self._written += 1
        self._tell(refresh=True)

    def _tell(self, *, refresh: bool) -> None:
        minutes = max(time.monotonic() - self._start, 1e-6) / 60.0
        words = [f"{self._counted / minutes:.1f} episodes/min, {self._failed} without success"]
        if self._written:
            words.append(f"{self._written} written")
        self._bar.set_postfix_str(", ".join(words), refresh=refresh)
