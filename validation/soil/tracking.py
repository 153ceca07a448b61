"""Progress of long series on a terminal; silent in files and tests."""

from collections.abc import Iterable, Iterator

from tqdm import tqdm


def track[Item](items: Iterable[Item], label: str) -> Iterator[Item]:
    """Yield the items while a bar that vanishes at the end counts them.

    Args:
        items: What to go through; a list, if the bar is to know its end.
        label: Text before the bar.
    """
    # disable=None: no bar unless the error stream is a terminal.
    yield from tqdm(items, desc=label, leave=False, disable=None)
