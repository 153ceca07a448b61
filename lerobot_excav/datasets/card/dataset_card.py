"""The README of a dataset, in the form of LeRobot's dataset cards."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import jinja2
import pandas as pd

from lerobot_excav.datasets.card.contact_sheet import contact_sheet
from lerobot_excav.datasets.check.quality_check import check_dataset, note_verdicts
from lerobot_excav.datasets.format.dataset_info import DatasetInfo, read_info
from lerobot_excav.datasets.format.version_check import require_one_version, versions_of
from lerobot_excav.datasets.pairs.pair_coverage import SCENE_COLUMNS, pair_coverage
from lerobot_excav.datasets.pairs.paired_index import write_index
from lerobot_excav.envs.tasks.registry import task_of_robot
from lerobot_excav.errors import DatasetError
from lerobot_excav.whole_file import whole_file

CARD_PATH = Path("README.md")
PICTURE_PATH = Path("meta/excav_card.png")

MARK = "<!-- lerobot-excav card -->"
"""By which a card of ours is known; another README stays."""

TEMPLATE = Path(__file__).with_name("dataset_card.md.jinja")


@dataclass(frozen=True, kw_only=True)
class DatasetCard:
    """What a card says.

    Attributes:
        title: Heading.
        description: All that LeRobot's own card does not know, in Markdown.
        tags: For the search of the Hugging Face Hub.
        license: As the Hub spells it.
    """

    title: str
    description: str
    tags: list[str]
    license: str

    def text(self, root: Path) -> str:
        """Return the whole README of a dataset on disk: LeRobot's own card about the description."""
        from lerobot.datasets import LeRobotDatasetMetadata
        from lerobot.datasets.utils import create_lerobot_dataset_card

        written = create_lerobot_dataset_card(
            tags=self.tags,
            dataset_info=LeRobotDatasetMetadata(f"local/{self.title}", root=root).info,
            license=self.license,
            dataset_description=self.description,
        )
        return f"{written}\n"

    def push(self, root: Path, repo_id: str, *, private: bool | None = None) -> None:
        """Upload a dataset to the Hugging Face Hub with LeRobot's own upload, this card in it.

        Args:
            root: The dataset.
            repo_id: Where to, as `USER/NAME`.
            private: Whether only its owner sees it; None leaves it to the Hub.

        Raises:
            DatasetError: The Hub is not reached, or refuses.
        """
        from httpx import HTTPError
        from lerobot.datasets import LeRobotDataset

        dataset = LeRobotDataset(repo_id, root=root)
        try:
            dataset.push_to_hub(
                tags=self.tags, license=self.license, private=private, dataset_description=self.description
            )
        except HTTPError as error:
            raise DatasetError(
                f"{repo_id} cannot be uploaded: {error}; log in with hf auth login, and give the same command again"
            ) from error


def write_card(
    root: Path, *, title: str | None = None, license: str = "apache-2.0", replays: int = 3, seed: int = 0
) -> DatasetCard:
    """Check a dataset, and write its card and its picture into it; the index is rebuilt.

    Args:
        root: The dataset.
        title: Heading; by default the name of its folder.
        license: Licence, as the Hugging Face Hub spells it.
        replays: How many episodes to replay.
        seed: Seed of the choice of replays.

    Raises:
        DatasetError: The quality check finds something, or another README is in the way.
    """
    require_own_card(root)
    report = check_dataset(root, replays=replays, seed=seed, show_progress=True)
    if not report.has_passed:
        raise DatasetError(f"{root} does not pass the quality check, so it gets no card; see lerobot-excav qc {root}")
    index = write_index(root)
    note_verdicts(root, report)
    info = read_info(root)
    versions = versions_of(index)
    require_one_version(versions, source=root)
    card = _card(title or root.resolve().name, license, info, index, replayed=int(report.episodes["replayed"].sum()))
    with whole_file(root / PICTURE_PATH) as temporary:
        contact_sheet(root, index).save(temporary, format="png", optimize=True)
    with whole_file(root / CARD_PATH) as temporary:
        temporary.write_text(card.text(root), encoding="utf-8")
    return card


def is_own_card(root: Path) -> bool:
    """Tell whether a dataset has a README that was written here."""
    path = root / CARD_PATH
    return path.is_file() and MARK in path.read_text(encoding="utf-8", errors="replace")


def require_own_card(root: Path) -> None:
    """Check that no README of somebody else would be lost.

    Raises:
        DatasetError: There is one.
    """
    path = root / CARD_PATH
    if path.exists() and not is_own_card(root):
        raise DatasetError(f"{path} was not written by lerobot-excav card; move it away, or it would be replaced")


def _card(title: str, license: str, info: DatasetInfo, index: pd.DataFrame, *, replayed: int) -> DatasetCard:
    spec = task_of_robot(info.spec.robot_type, str(index["task"].iloc[0]))
    frames, coverage = int(index["length"].sum()), pair_coverage(index)
    tasks = [task_of_robot(info.spec.robot_type, task) for task in index["task"].unique()]
    facts = {
        "Environment": f"`{spec.env_type}`, {_counted(index, 'task')}, simulation version {spec.simulation_version}",
        "Scenes": _scenes(index),
        "Pairs": f"{coverage.starts} starts, {coverage.complete_starts} of them with all their targets",
        "Episodes": f"{len(index)}; {frames} frames at {info.fps} a second, {frames / info.fps / 60.0:.1f} minutes",
        "Commanded by": _operators(index),
        **{
            name.replace("_", " ").capitalize(): _counted(index, name)
            for name in spec.settings.columns()
            if name != "task"
        },
        "Masks": _counted(index, "mask_source"),
        "Successes": f"{int(index['success'].sum())} of {len(index)}",
        "Quality check": f"{len(index)} of {len(index)} episodes passed; {replayed} were replayed, state by state",
    }
    text = jinja2.Template(TEMPLATE.read_text(encoding="utf-8"), keep_trailing_newline=False).render(
        mark=MARK, title=title, tasks=[task.description for task in tasks], facts=facts, picture=PICTURE_PATH.as_posix()
    )
    tags = ["robotics", "paired-demonstrations", "target-mask", spec.env_type]
    return DatasetCard(title=title, description=text, tags=tags, license=license)


def _scenes(index: pd.DataFrame) -> str:
    """Name the scenes, set by set, and the stages."""
    sets = [
        f"{len(rows)} of the set `{name}`, numbers {_ranges(rows['scene_id'].tolist())}"
        for name, rows in index[SCENE_COLUMNS].drop_duplicates().groupby("scene_set")
    ]
    stages = sorted(set(index["stage"]))
    return "; ".join(sets) + ("" if stages == [0] else f"; stages {_ranges(stages)}")


def _ranges(numbers: Sequence[int]) -> str:
    """Write whole numbers as ranges: 0 to 3, 7."""
    ranges: list[list[int]] = []
    for number in sorted(numbers):
        if ranges and number == ranges[-1][1] + 1:
            ranges[-1][1] = number
        else:
            ranges.append([number, number])
    return ", ".join(f"{first}" if first == last else f"{first} to {last}" for first, last in ranges)


def _operators(index: pd.DataFrame) -> str:
    words = {"scripted": "a script", "person": "a person", "policy": "a policy"}
    named = [f"{words[str(name)]}: {count}" for name, count in index["operator"].value_counts().items()]
    taken_over = int((index["intervention_frames"] > 0).sum())
    return ", ".join(named) + (f"; a person took over in {taken_over}" if taken_over else "")


def _counted(index: pd.DataFrame, column: str) -> str:
    counts = index[column].astype(str).value_counts()
    if len(counts) == 1:
        return str(counts.index[0]) or "none"
    return ", ".join(f"{value or 'none'}: {count}" for value, count in counts.items())
