"""Putting a new dataset in the place of another, so that whatever fails leaves the old one as it was.

Only what LeRobot keeps is exchanged, within the folder: a symbolic link to it, the working directory of a shell, and
files that somebody put beside the data stay.
"""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from lerobot_excav.errors import DatasetError

CONTENTS = ("data", "images", "meta", "videos")
"""What LeRobot makes in the folder of a dataset."""

DERIVED = (
    *("meta/info.json", "meta/stats.json", "meta/tasks.parquet", "meta/excav_pairs.parquet"),
    *("meta/episodes/*/*.parquet", "data/*/*.parquet", "videos/*/*/*.mp4"),
)
"""Files that a rebuilt dataset has again; patterns of paths."""


def require_free(out: Path | None) -> None:
    """Check that nothing is where a new dataset is to go.

    Raises:
        DatasetError: Something is.
    """
    if out is not None and (out.exists() or out.is_symlink()):
        raise DatasetError(f"--out={out} exists; choose another folder, or remove it first")


@contextmanager
def workspace(beside: Path) -> Iterator[Path]:
    """Provide an empty folder beside another one, on the same disk; it is removed at the end with what it holds."""
    beside.parent.mkdir(parents=True, exist_ok=True)
    folder = Path(tempfile.mkdtemp(prefix=f".{beside.name}.", dir=beside.parent))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def exchange(new: Path, root: Path, aside: Path) -> None:
    """Move the dataset at `root` into a new folder `aside`, and that at `new` to `root`.

    Raises:
        OSError: A part cannot be moved; then everything is back in its place.
    """
    aside.mkdir()
    moves = [(root / name, aside / name) for name in CONTENTS if (root / name).exists()]
    moves += [(path, root / path.name) for path in sorted(new.iterdir())]
    done: list[tuple[Path, Path]] = []
    try:
        for source, destination in moves:
            source.rename(destination)
            done.append((source, destination))
    except BaseException:
        for source, destination in reversed(done):
            destination.rename(source)
        aside.rmdir()
        raise


def copy_foreign_files(root: Path, new: Path) -> None:
    """Copy what a dataset holds among LeRobot's own files into the one that is to take its place."""
    for path in (path for name in CONTENTS for path in sorted((root / name).rglob("*"))):
        relative = path.relative_to(root)
        is_derived = any(relative.match(known) and len(relative.parts) == known.count("/") + 1 for known in DERIVED)
        if path.is_file() and not is_derived and not (new / relative).exists():
            (new / relative).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(path, new / relative)
