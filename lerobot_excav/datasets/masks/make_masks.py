"""Making the masks of a whole dataset."""

import hashlib
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from tqdm import tqdm

from lerobot_excav.datasets.complete.exchange import require_free, workspace
from lerobot_excav.datasets.format.dataset_info import INFO_PATH, DatasetInfo, read_info
from lerobot_excav.datasets.format.episode_table import iterate_episodes
from lerobot_excav.datasets.format.schema import PAIR_KEY, SIMULATION_KEY, camera_key
from lerobot_excav.datasets.format.version_check import require_this_simulation
from lerobot_excav.datasets.masks import recorded_pictures, simulated_starts
from lerobot_excav.datasets.masks.found_masks import FoundMask, FoundMasks
from lerobot_excav.datasets.masks.mask_column import write_with_masks
from lerobot_excav.datasets.pairs.paired_index import write_index
from lerobot_excav.envs.masks.picture_view import PictureView
from lerobot_excav.envs.masks.snapped import SnappedMasks
from lerobot_excav.envs.masks.source import MaskSource, chooses_target, make_mask_source
from lerobot_excav.errors import require

Episode = tuple[int, Callable[[], list[FoundMask]]]
"""The number of an episode, and what finds its masks."""


def make_masks(
    root: Path,
    out: Path,
    *,
    source: str,
    options: str | None = None,
    text: str | None = None,
    snap: bool = False,
    main_camera: str | None = None,
    show_progress: bool = False,
) -> int:
    """Write a copy of a dataset with the masks of a source; the same call goes on after an interruption.

    Args:
        root: The dataset: demonstrations of this package, whose starts the simulator shows again, or any other one.
        out: The copy.
        source: Name of the source.
        options: TOML file of what it is told.
        text: What to look for, before what the options and the task say.
        snap: Whether each mask is snapped onto the object under its middle.
        main_camera: Camera of a dataset of somebody else, as in its features.
        show_progress: Whether to draw a bar.

    Returns:
        Number of episodes.

    Raises:
        DatasetError: A dataset cannot be read, `out` exists, or the source finds nothing in an episode.
        ConfigurationError: There is no such source, or it cannot be used here.
    """
    require_free(out)
    info = read_info(root)
    is_ours = PAIR_KEY in info.features
    _require_use(root, out, source, main_camera, text, is_ours=is_ours)
    if is_ours and snap:
        info.spec.make_settings(mask_snap=True)  # refused where there is nothing to snap to
    made = make_mask_source(source, options=options, text=text)
    made = SnappedMasks(made) if snap else made
    told: dict[str, Any] = {"source": source, "options": options, "text": text, "main_camera": main_camera}
    settings = _settings(root, told | ({"snap": True} if snap else {}))
    episodes = (
        _of_ours(root, info, made) if is_ours else _of_others(root, info, made, main_camera or camera_key("main"))
    )
    with FoundMasks(out, settings) as found:
        for index, find in tqdm(
            episodes, total=info.total_episodes, desc="masks", unit="episode", disable=not show_progress
        ):
            if index not in found.episodes:
                found.add(index, find())
        with workspace(beside=out) as folder:
            write_with_masks(root, folder / "dataset", found.episodes, _provenance(settings))
            if is_ours:
                write_index(folder / "dataset")
            (folder / "dataset").rename(out)
        found.clear()
    return info.total_episodes


def _require_use(
    root: Path, out: Path, source: str, main_camera: str | None, text: str | None, *, is_ours: bool
) -> None:
    """Refuse what could not be done, or would have no effect."""
    require(
        root.resolve() not in out.resolve().parents, f"--out={out} lies within {root}; choose a folder outside of it"
    )
    require(
        not chooses_target(source),
        f"--source={source} chooses where to act by itself, and recorded actions lead elsewhere; take another source",
    )
    require(
        not (is_ours and main_camera),
        f"--main_camera={main_camera} has no effect: these demonstrations have a camera that is called main",
    )
    require(
        not (is_ours and text is not None),
        f"--mask.text={text!r} would name the same thing for all targets; leave it out: each has its name here",
    )


def _of_ours(root: Path, info: DatasetInfo, source: MaskSource) -> Iterator[Episode]:
    size = info.size_of(camera_key("main"))
    versions = {e.index: e.simulation_version for e in iterate_episodes(root, [SIMULATION_KEY])}
    require_this_simulation(info.spec, versions, source=root, instead="")
    for recorded in iterate_episodes(root, simulated_starts.needed_keys(info.spec)):
        yield recorded.index, partial(simulated_starts.find_masks, recorded, source, fps=info.fps, size=size)


def _of_others(root: Path, info: DatasetInfo, source: MaskSource, camera: str) -> Iterator[Episode]:
    view = recorded_pictures.first_pictures(root, camera)
    for index in range(info.total_episodes):
        yield index, partial(_of_picture, view, index, source)


def _of_picture(view: Callable[[int], PictureView], index: int, source: MaskSource) -> list[FoundMask]:
    return recorded_pictures.find_masks(view(index), source, index)


def _settings(root: Path, told: dict[str, Any]) -> dict[str, Any]:
    """Return all that decides about the masks: what was told, and digests of the files that it names."""
    options = told["options"]
    return {
        **told,
        "dataset": root.name,
        "told": None if options is None else _digest([Path(options)]),
        "episodes": _digest([root / INFO_PATH, *sorted(root.glob("meta/episodes/*/*.parquet"))]),
    }


def _digest(paths: Sequence[Path]) -> str:
    """Return a digest of files, so that a run goes on only with the same ones."""
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _provenance(settings: dict[str, Any]) -> dict[str, Any]:
    """Return what is noted of the masks: a folder's place is nobody's business."""
    options = settings["options"]
    return {**settings, "options": None if options is None else Path(options).name}
