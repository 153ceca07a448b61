"""The files of a result page."""

import json
import shutil
from pathlib import Path

from lerobot_excav.evaluation.metrics import Evaluation
from lerobot_excav.evaluation.provenance import EvaluationOrigin
from lerobot_excav.evaluation.report_folder import ReportFolder
from lerobot_excav.evaluation.result_page.contents import CURVES
from lerobot_excav.evaluation.result_page.kept_grid import (
    SHOWN,
    VIDEO_GRID,
    ShownClips,
    is_poorer,
    kept_clips,
    shown_clips,
    shown_text,
)
from lerobot_excav.evaluation.result_page.method_figures import method_figures
from lerobot_excav.evaluation.result_page.page import ResultPage
from lerobot_excav.evaluation.result_page.page_text import CURVE_PLOT, page_text
from lerobot_excav.evaluation.result_page.plots import plot_curves
from lerobot_excav.evaluation.result_page.video_grid import grid_rows, present_clips, write_grid
from lerobot_excav.whole_file import write_whole

METRICS = "metrics"
TEXTS = ("report.md", "report.json", "rows.jsonl")


def write_page(page: ResultPage, folder: Path) -> list[Path]:
    """Write a page, its data, and the metrics that it is made of.

    `report.md`, `report.json`, `rows.jsonl` (one row each), `success.png`, `rollouts.mp4` with
    `rollouts.json`, what it shows, and `metrics/LABEL.jsonl` with `metrics/LABEL.json`, where it comes from. A page can
    be made again from these copies; those of an earlier page are removed. A plot that could not be made again, because
    checkpoints are gone, stays, and a video that shows more than could be shown now.
    Returns what was written, but for the copies.

    Raises:
        DatasetError: A file that no page has written, or that was changed since, lies in the place of one.
    """
    report = ReportFolder(folder)
    report.require_free(TEXTS)
    with report.staged() as stage:
        copies = _keep_metrics(page, stage / METRICS, folder / METRICS)
        kept, clips = kept_clips(report), shown_clips(page, present_clips(page))
        is_kept = kept is not None and is_poorer(clips, kept, page)
        pictures = [*_plots(page, stage), *([] if is_kept else _grid(page, clips, stage))]
        beside = {*pictures, *({CURVE_PLOT, VIDEO_GRID} & set(report.own))}
        text = page_text(page, files=beside, clips=kept if is_kept or not clips else clips)
        rows = "".join(json.dumps(row.as_dict()) + "\n" for row in page.rows)
        for name, content in zip(TEXTS, (text, json.dumps(page.as_dict(), indent=1) + "\n", rows), strict=True):
            write_whole(stage / name, content)
    report.remove(lambda name: name.endswith(".png") and name not in beside)
    if Path(page.contents.metrics).resolve() != (folder / METRICS).resolve():  # not made of the copies themselves
        report.remove(lambda name: name.startswith(f"{METRICS}/") and name not in copies)
    return [folder / name for name in (*TEXTS, *pictures)]


def _keep_metrics(page: ResultPage, stage: Path, folder: Path) -> set[str]:
    """Copy what the page is made of; return the names of the copies, seen from the page."""
    kept: list[tuple[str, Evaluation, EvaluationOrigin]] = [part for row in page.rows for part in row.parts]
    for curve in page.curves:
        kept += [(f"{CURVES}/{curve.name}/{point.step:06d}", point.run.first, point.origin) for point in curve.points]
    for name, evaluation, origin in kept:
        if evaluation.path.resolve() != (folder / f"{name}.jsonl").resolve():
            copy = stage / f"{name}.jsonl"
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(evaluation.path, copy)
            write_whole(stage / f"{name}.json", origin.model_dump_json(indent=1) + "\n")
    return {f"{METRICS}/{name}.{suffix}" for name, *_ in kept for suffix in ("jsonl", "json")}


def _plots(page: ResultPage, folder: Path) -> list[str]:
    if page.curves:
        plot_curves(page.curves, folder / CURVE_PLOT)
    figures = [figure for section in page.sections for figure in method_figures(section)]
    for figure in figures:
        figure.draw(folder / figure.name)
    return [*([CURVE_PLOT] if page.curves else []), *(figure.name for figure in figures)]


def _grid(page: ResultPage, clips: list[ShownClips], folder: Path) -> list[str]:
    rows = grid_rows(page)
    if not rows:
        return []
    write_grid(folder / VIDEO_GRID, rows)
    write_whole(folder / SHOWN, shown_text(clips))
    return [VIDEO_GRID, SHOWN]
