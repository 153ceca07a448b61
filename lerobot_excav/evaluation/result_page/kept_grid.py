"""What the video grid of a page shows, written beside it: its videos may be gone when the page is made again."""

import json
from collections.abc import Sequence

from pydantic import BaseModel, ConfigDict

from lerobot_excav.datasets.format.validated import validated_file
from lerobot_excav.evaluation.report_folder import ReportFolder, file_digest
from lerobot_excav.evaluation.result_page.contents import Clips
from lerobot_excav.evaluation.result_page.page import ResultPage

VIDEO_GRID = "rollouts.mp4"
SHOWN = "rollouts.json"


class ShownClips(Clips):
    """Episodes that a grid shows in a row, and a digest (SHA-256) of the metrics that they are of."""

    metrics_sha256: str


class _Shown(BaseModel):
    """Rows of a video grid, from top to bottom."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid")

    clips: tuple[ShownClips, ...]


def shown_clips(page: ResultPage, clips: Sequence[Clips]) -> list[ShownClips]:
    """Return clips of a page's rows with what they are of; those of rows that were not played are left out."""
    return [
        ShownClips(label=row.label, episodes=row.episodes, metrics_sha256=digest)
        for row in clips
        if (digest := _digest(page, row.label)) is not None
    ]


def shown_text(clips: Sequence[ShownClips]) -> str:
    """Return the content of the file that says what a video grid shows."""
    return json.dumps(_Shown(clips=tuple(clips)).model_dump(), indent=1) + "\n"


def kept_clips(report: ReportFolder) -> list[ShownClips] | None:
    """Return what the video grid of an earlier page shows; None if none is there, or nobody has written what it shows.

    Pages of version 0.2.0 have not. A grid or a list that was changed since is nobody's.

    Raises:
        DatasetError: The list cannot be read.
    """
    if not {VIDEO_GRID, SHOWN} <= set(report.own):
        return None
    return list(validated_file(_Shown, report.folder / SHOWN).clips)


def is_poorer(clips: Sequence[Clips], kept: Sequence[ShownClips], page: ResultPage) -> bool:
    """Tell whether a grid of `clips` would lack episodes that the kept grid shows, of rows as they are now."""
    named = _episodes(page.contents.clips)
    current = _episodes([row for row in kept if not is_of_earlier_metrics(row, page)])
    return bool((current & named) - _episodes(clips))


def is_of_earlier_metrics(shown: ShownClips, page: ResultPage) -> bool:
    """Tell whether a kept row shows other episodes than those that the page's numbers are of."""
    return _digest(page, shown.label) != shown.metrics_sha256


def _digest(page: ResultPage, label: str) -> str | None:
    """Return the digest of the metrics that the videos of a row are of, those of its first seed; None if not played."""
    path = next((row.parts[0][1].path for row in page.rows if row.row.label == label), None)
    return None if path is None else file_digest(path)


def _episodes(clips: Sequence[Clips]) -> set[tuple[str, int]]:
    return {(row.label, number) for row in clips for number in row.episodes}
