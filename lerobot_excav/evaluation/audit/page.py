"""The page of an audit: a sentence, a table, pictures, and the same as data for machines."""

import json
from pathlib import Path

from lerobot_excav.evaluation.audit import verdict as thresholds
from lerobot_excav.evaluation.audit.audit import Audit
from lerobot_excav.evaluation.audit.figures import draw_paths, draw_places, draw_separation
from lerobot_excav.evaluation.audit.obedience import Obedience
from lerobot_excav.evaluation.audit.settings import FOLLOWED_S, LEAD_S, POLICY
from lerobot_excav.evaluation.markdown import interval_text, render
from lerobot_excav.evaluation.report_folder import ReportFolder
from lerobot_excav.evaluation.statistics import Interval
from lerobot_excav.whole_file import write_whole

HEADER = [
    *("who acts", "verdict", "masks", "acts [%]", "success [%]", "slope", "entry error [m]"),
    *("share in the region [%]", "of the operator's [%]"),
]
FIGURES = {"audit_places.png": draw_places, "audit_separation.png": draw_separation, "audit_paths.png": draw_paths}


def audit_text(audit: Audit) -> str:
    """Write an audit as Markdown, without its pictures."""
    verdict = audit.verdicts[POLICY]
    return render(
        "audit",
        task=audit.settings.task_spec.id,
        scene_set=audit.settings.env.scene_set,
        scenes=len(audit.settings.scene_ids),
        played=audit.settings.played_words,
        sentence=f"Verdict: **{verdict.verdict}**; {verdict.reason}.",
        header=HEADER,
        rows=[_row(label, audit.verdicts[label].verdict, found) for label, found in audit.obedience.items()],
        lead_s=LEAD_S,
        followed_s=FOLLOWED_S,
        thresholds=thresholds,
    )


def write_audit(audit: Audit, folder: Path) -> list[Path]:
    """Write `audit.md`, `audit.json` and the pictures into a folder, which is made; return what it wrote.

    Raises:
        DatasetError: A file of that name was not written by a report, or was changed since.
    """
    shown = "".join(f"\n![{name.removeprefix('audit_').removesuffix('.png')}]({name})\n" for name in FIGURES)
    with ReportFolder(folder).staged() as stage:
        write_whole(stage / "audit.md", audit_text(audit) + shown)
        write_whole(stage / "audit.json", json.dumps(audit.as_dict(), indent=1) + "\n")
        for name, draw in FIGURES.items():
            draw(audit, stage / name)
    return [folder / name for name in ("audit.md", "audit.json", *FIGURES)]


def _row(label: str, verdict: str, found: Obedience) -> list[str]:
    return [
        *(label, verdict, str(found.branches)),
        *(_text(found.acted, 100.0), _text(found.success, 100.0)),
        *(_text(found.slope, digits=2), _text(found.entry_error_m, digits=3)),
        *(_text(found.share, 100.0), _text(found.relative_share, 100.0)),
    ]


def _text(interval: Interval | None, scale: float = 1.0, *, digits: int = 1) -> str:
    return "-" if interval is None else interval_text(interval, scale=scale, digits=digits)
