"""The files of a result page."""

import json
import shutil
from pathlib import Path

from lerobot_excav.evaluation.provenance import EvaluationOrigin
from lerobot_excav.evaluation.result_page.contents import CURVES
from lerobot_excav.evaluation.result_page.page import ResultPage
from lerobot_excav.evaluation.result_page.page_text import CURVE_PLOT, VIDEO_GRID, page_text
from lerobot_excav.evaluation.result_page.plots import plot_curves
from lerobot_excav.evaluation.result_page.video_grid import grid_clips, present_clips, write_grid
from lerobot_excav.evaluation.run import Run


def write_page(page: ResultPage, folder: Path) -> list[Path]:
    """Write a page, its data, and the metrics that it is made of.

    `report.md`, `report.json`, `rows.jsonl` (one row each), `success.png`, `rollouts.mp4`, and `metrics/LABEL.jsonl`
    with `metrics/LABEL.json`, where it comes from. A page can be made again from these copies; those of an earlier page
    are removed. A plot or video that could not be made again, because checkpoints or videos are gone, stays.
    Returns what was written, but for the copies.
    """
    folder.mkdir(parents=True, exist_ok=True)
    _keep_metrics(page, folder / "metrics")
    written = _pictures(page, folder)
    beside = [name for name in (CURVE_PLOT, VIDEO_GRID) if (folder / name).exists()]
    texts = {
        "report.md": page_text(page, files=beside, clips=present_clips(page) or None),
        "report.json": json.dumps(page.as_dict(), indent=1) + "\n",
        "rows.jsonl": "".join(json.dumps(row.as_dict()) + "\n" for row in page.rows),
    }
    for name, text in texts.items():
        (folder / name).write_text(text)
    return [*(folder / name for name in texts), *written]


def _keep_metrics(page: ResultPage, folder: Path) -> None:
    """Copy what the page is made of, and remove what an earlier one was: a page made of the copies must be the same."""
    copies = [_copy_metrics(row.run, folder / f"{row.row.label}.jsonl", row.origin) for row in page.rows]
    for curve in page.curves:
        for point in curve.points:
            copy = folder / CURVES / curve.name / f"{point.step:06d}.jsonl"
            copies.append(_copy_metrics(point.run, copy, point.origin))
    if Path(page.contents.metrics).resolve() == folder.resolve():
        return  # made of the copies themselves
    for kept in [*folder.glob("*.jsonl"), *folder.glob(f"{CURVES}/*/*.jsonl")]:
        # Only a page's own copies tell beside them where they come from.
        if kept not in copies and (origin := kept.with_suffix(".json")).exists():
            kept.unlink()
            origin.unlink()


def _copy_metrics(run: Run, copy: Path, origin: EvaluationOrigin) -> Path:
    copy.parent.mkdir(parents=True, exist_ok=True)
    if run.first.path.resolve() != copy.resolve():
        shutil.copyfile(run.first.path, copy)
    copy.with_suffix(".json").write_text(origin.model_dump_json(indent=1) + "\n")
    return copy


def _pictures(page: ResultPage, folder: Path) -> list[Path]:
    clips = grid_clips(page)
    if page.curves:
        plot_curves(page.curves, folder / CURVE_PLOT)
    if clips:
        write_grid(folder / VIDEO_GRID, clips)
    return [folder / name for name, shown in ((CURVE_PLOT, page.curves), (VIDEO_GRID, clips)) if shown]
