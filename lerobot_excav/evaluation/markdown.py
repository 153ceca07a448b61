"""Markdown of reports: the templates of this package, and tables that read as plain text, too."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from lerobot_excav.envs.tasks.measures import Column
from lerobot_excav.evaluation.comparison import Difference
from lerobot_excav.evaluation.run_summary import RateOf, Value
from lerobot_excav.evaluation.statistics import Interval

if TYPE_CHECKING:
    from jinja2 import BaseLoader, Environment


def render(template: str, **values: Any) -> str:
    """Fill `templates/TEMPLATE.md.jinja` with values by their names; `table(header, rows)` is there as well."""
    from jinja2 import PackageLoader

    found = templates(PackageLoader("lerobot_excav.evaluation")).get_template(f"{template}.md.jinja")
    return found.render(table=markdown_table, **values)


def templates(loader: "BaseLoader") -> "Environment":
    """Return the environment of Markdown templates that a loader finds."""
    from jinja2 import Environment, StrictUndefined

    return Environment(
        loader=loader, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True, undefined=StrictUndefined
    )


def markdown_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Lay out a table whose columns line up, so that it reads well unrendered."""
    widths = [max(map(len, cells)) for cells in zip(header, *rows, strict=True)]
    lines = [header, ["-" * width for width in widths], *rows]
    padded = ([cell.ljust(width) for cell, width in zip(line, widths, strict=True)] for line in lines)
    return "\n".join(f"| {' | '.join(cells)} |" for cells in padded)


def value_text(column: Column, value: Value) -> str:
    """Write the value of a column, with its interval and, if it is a rate of some episodes only, their number."""
    if value is None:
        return "-"
    if isinstance(value, dict):
        return " / ".join(str(value[word]) for word in column.words)
    of = f" of {value.n}" if isinstance(value, RateOf) else ""
    return interval_text(value, scale=column.scale) + of


def difference_cells(column: Column, change: Difference) -> list[str]:
    """Write a difference and its p-value."""
    return [interval_text(change.difference, scale=column.scale, sign="+"), p_text(change.p_value)]


def p_text(p_value: float | None) -> str:
    """Write a p-value, if there is one."""
    return "-" if p_value is None else f"{p_value:.3g}"


def interval_text(interval: Interval, *, scale: float = 1.0, sign: str = "", digits: int = 1) -> str:
    """Write an estimate and its interval, as `40.0 [16.8, 68.7]`."""
    low, estimate, high = (scale * value for value in (interval.low, interval.estimate, interval.high))
    return f"{estimate:{sign}.{digits}f} [{low:{sign}.{digits}f}, {high:{sign}.{digits}f}]"
