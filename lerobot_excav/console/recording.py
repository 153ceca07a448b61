"""Recording demonstrations from the page: which start is next, what is kept, and the dataset that comes of it.

As with `lerobot-excav demos`, a dataset `OUT` is a folder `OUT.partial` while it grows: every finished episode is two
files there, so what kills the console takes the episode in hand at most, and the same command goes on.
"""

from collections.abc import Callable
from pathlib import Path

from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.episode import Episode
from lerobot_excav.datasets.record.episode_store import EpisodeStore
from lerobot_excav.datasets.record.partial_run import PartialRun
from lerobot_excav.errors import DatasetError, require


class Recording:
    """The paired schedule of a dataset, and the episodes that are finished.

    Args:
        settings: Environment, scenes, targets and stages; the order is theirs.
        out: Folder of the dataset.

    Raises:
        DatasetError: `out` exists, its partial folder is not of such a recording, or another process is at it.
        ConfigurationError: The recording was begun with other settings.
    """

    def __init__(self, settings: DemonstrationSettings, out: Path) -> None:
        if out.exists() or out.is_symlink():
            raise DatasetError(f"--out={out} exists; choose another folder, or remove it first")
        settings.env.require_commanded_mask()
        out.parent.mkdir(parents=True, exist_ok=True)
        self.settings, self.out = settings, out
        self._partial = PartialRun(out, settings, resume=True)
        self._store = EpisodeStore(self._partial.episodes)
        self._pairs = settings.pairs()
        self._outcomes = {pair: self._store.outcome(pair) for pair in self._pairs}
        self._put_off: list[Pair] = []
        self.is_complete = False

    @property
    def left(self) -> list[Pair]:
        """The starts that are still to be recorded, the next one first."""
        missing = [pair for pair in self._pairs if self._outcomes[pair] is None]
        return [*(p for p in missing if p not in self._put_off), *(p for p in self._put_off if p in missing)]

    @property
    def kept(self) -> int:
        """How many episodes are kept."""
        return len(self._kept)

    @property
    def _kept(self) -> list[Pair]:
        return [pair for pair, outcome in self._outcomes.items() if outcome is not None and outcome["kept"]]

    @property
    def count(self) -> int:
        """How many starts there are."""
        return len(self._pairs)

    def keep(self, episode: Episode) -> None:
        """Put an episode on the disk; from here on nothing takes it away.

        Raises:
            DatasetError: The machine waited for its mask in it, which no replay can repeat.
        """
        require(episode.pair in self._pairs, f"{episode.pair.uid} is not among the starts of this recording")
        if episode.mask_missing_frames:
            raise DatasetError("the machine waited for its mask, which no replay can repeat; record the episode again")
        self._outcomes[episode.pair] = self._store.write(episode, keep_frames=True)

    def put_off(self, pair: Pair) -> None:
        """Record a start after all others."""
        self._put_off = [*(p for p in self._put_off if p != pair), pair]

    def leave_out(self, pair: Pair) -> None:
        """Note that a start does not offer its target."""
        self._outcomes[pair] = self._store.write_absent(pair)

    def complete(self, progress: Callable[[int, int], None] = lambda done, count: None) -> Path:
        """Make the dataset of the episodes that are kept, with its index; return its folder.

        Args:
            progress: Called with the number of episodes that are written, and of all.

        Raises:
            DatasetError: No episode is kept.
        """
        from lerobot_excav.datasets.pairs.paired_index import write_index
        from lerobot_excav.datasets.record.assembly import append_episode, close_dataset, create_dataset

        kept = self._kept
        if not kept:
            raise DatasetError("no episode is kept yet, so there is nothing to write; record one first")
        self._partial.remove_unfinished_dataset()  # of a try that failed
        longest = max(outcome["frames"] for outcome in self._outcomes.values() if outcome is not None)
        dataset = create_dataset(self._partial.dataset, self.settings, longest=longest)
        try:
            for number, pair in enumerate(kept, start=1):
                append_episode(dataset, self._store.read(pair), self.settings)
                progress(number, len(kept))
        finally:
            dataset.writer.stop_image_writer()  # or its threads would go on writing into a folder that is given up
        close_dataset(dataset)
        write_index(self._partial.dataset)
        self._partial.dataset.rename(self.out)
        self._partial.clear()
        self.close()
        self.is_complete = True
        return self.out

    def close(self) -> None:
        """Let go of the folder; what is in it stays."""
        self._partial.__exit__()
