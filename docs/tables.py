"""Write the tables of settings and options into the pages: `python docs/tables.py`.

A table stands between the lines `<!-- table: module:Class -->` and `<!-- end of table -->`. It lists the fields of that
dataclass: name, default, meaning. `-module:Class` leaves out the fields that this other class has already.
"""

import dataclasses
import re
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

PAGES = Path(__file__).parent
TABLE = re.compile(r"(<!-- table: (\S+)(?: -(\S+))? -->\n).*?(<!-- end of table -->)", re.DOTALL)


def table(cls: type, without: type | None = None) -> str:
    """Return the documented fields of a dataclass as a Markdown table.

    Args:
        cls: The dataclass.
        without: Its fields are left out, unless their default is another one here.
    """
    left_out = {field.name: field.default for field in dataclasses.fields(without)} if without else {}
    rows = ["| name | default | meaning |", "|---|---|---|"]
    for field in dataclasses.fields(cls):
        words = field.metadata.get("custom_args", {}).get("help")
        is_repeated = field.name in left_out and left_out[field.name] == field.default
        if words and not is_repeated:
            rows.append(f"| `{field.name}` | {_default(field)} | {words.replace('%%', '%')} |")
    return "\n".join(rows) + "\n"


def with_tables(text: str) -> str:
    """Return a page with its tables as they should be."""

    def written(match: re.Match[str]) -> str:
        begin, cls, without, end = match.groups()
        return f"{begin}\n{table(resolve_name(cls), resolve_name(without) if without else None)}\n{end}"

    return TABLE.sub(written, text)


def _default(field: "dataclasses.Field[Any]") -> str:
    value = field.default
    if value is dataclasses.MISSING or value is None:
        return ""
    return f"`{str(value).lower()}`" if isinstance(value, bool) else f"`{value}`"


if __name__ == "__main__":
    for page in sorted(PAGES.rglob("*.md")):
        text = page.read_text(encoding="utf-8")
        if text != (new := with_tables(text)):
            page.write_text(new, encoding="utf-8")
            print(f"written: {page}")  # noqa: T201
