"""Pictures that set the rows of a section beside each other, where their task has such pictures."""

import re
from dataclasses import dataclass
from pathlib import Path
from pkgutil import resolve_name

from lerobot_excav.evaluation.result_page.overlap_figure import ABOUT, ENTRY, has_imprecise_masks
from lerobot_excav.evaluation.result_page.page import PageSection


@dataclass(frozen=True, kw_only=True)
class MethodFigure:
    """A picture of a section.

    Attributes:
        name: Name of its file.
        about: What it shows, in a few words.
        entry: Function that draws it.
        section: The section.
    """

    name: str
    about: str
    entry: str
    section: PageSection

    def draw(self, path: Path) -> None:
        """Draw it into a file."""
        rows = [row.row for row in self.section.rows]
        abouts = [row.about for row in rows]
        names = [row.about if abouts.count(row.about) == 1 else row.label for row in rows]
        runs = [row.run.episodes for row in self.section.rows]
        resolve_name(self.entry)(dict(zip(names, runs, strict=True)), path)


def method_figures(section: PageSection) -> list[MethodFigure]:
    """Return the pictures of a section: none unless two rows of it have been run."""
    if len(section.rows) < 2:
        return []
    figures = dict(section.rows[0].run.measures.method_figures)
    if any(has_imprecise_masks(row.run.episodes) for row in section.rows):
        figures[ABOUT] = ENTRY
    return [
        MethodFigure(
            name=f"{_slug(section.section.title)}_{_slug(about)}.png", about=about, entry=entry, section=section
        )
        for about, entry in figures.items()
    ]


def _slug(text: str) -> str:
    return re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_")
