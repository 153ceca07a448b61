"""What the video grid of a page shows, written beside it: its videos may be gone when the page is made again."""

import json
from collections.abc import Sequence

from pydantic import BaseModel, ConfigDict

from lerobot_excav.datasets.format.validated import validated_file
from lerobot_excav.evaluation.report_folder import ReportFolder
from lerobot_excav.evaluation.result_page.contents import Clips, Contents

VIDEO_GRID = "rollouts.mp4"
SHOWN = "rollouts.json"


class _Shown(BaseModel):
    """Rows of a video grid, from top to bottom."""

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid")

    clips: tuple[Clips, ...]


def shown_text(clips: Sequence[Clips]) -> str:
    """Return the content of the file that says what a video grid shows."""
    return json.dumps(_Shown(clips=tuple(clips)).model_dump(), indent=1) + "\n"


def kept_clips(report: ReportFolder, contents: Contents) -> tuple[Clips, ...]:
    """Return what the video grid of an earlier page shows; nothing if none is there, or somebody has changed it.

    Pages of version 0.2.0 did not write what theirs show: it is taken to be all that the contents name.

    Raises:
        DatasetError: What the grid shows cannot be read.
    """
    if VIDEO_GRID not in report.own:
        return ()
    if SHOWN not in report.own:
        return contents.clips
    return validated_file(_Shown, report.folder / SHOWN).clips


def is_poorer(clips: Sequence[Clips], kept: Sequence[Clips], contents: Contents) -> bool:
    """Tell whether a grid of `clips` would lack episodes that the contents name and the kept grid shows."""
    named, there = _episodes(contents.clips), _episodes(clips)
    return bool((_episodes(kept) & named) - there)


def _episodes(clips: Sequence[Clips]) -> set[tuple[str, int]]:
    return {(row.label, number) for row in clips for number in row.episodes}
