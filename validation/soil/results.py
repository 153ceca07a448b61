"""What an experiment found: gated values, tables, plots."""

import math
from dataclasses import asdict, dataclass
from typing import Any, Literal, NamedTuple

from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Check:
    """One measured value and its gate from `low` to `high`; `unit` is empty for a pure number."""

    name: str
    value: float
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf

    @property
    def passed(self) -> bool:
        """Whether the value is inside its gate; a value that is not a number is not."""
        return self.low <= self.value <= self.high

    @property
    def missed_by(self) -> float:
        """Distance to the gate in the value's unit; 0 inside, infinite if the value is not a number."""
        if math.isnan(self.value):
            return math.inf
        return max(self.low - self.value, self.value - self.high, 0.0)

    def text(self, number: float) -> str:
        """Return a number with the unit."""
        return f"{number_text(number)} {self.unit}".rstrip()

    @property
    def gate_text(self) -> str:
        """The gate in words, with its unit."""
        low, high = number_text(self.low), number_text(self.high)
        if self.low == self.high:
            words = f"= {low}"
        elif math.isinf(self.low):
            words = f"≤ {high}"
        else:
            words = f"≥ {low}" if math.isinf(self.high) else f"{low} to {high}"
        return f"{words} {self.unit}".rstrip()


class Table(NamedTuple):
    """Values without a gate; the header has the units, and numbers are rounded when shown."""

    header: tuple[str, ...]
    rows: tuple[tuple[float | str, ...], ...]


class Series(NamedTuple):
    """One series of values: points, a curve, or a band between `y` and `y_high`.

    Series of one `color` look alike, such as theory and measurement of one thing; None takes the next colour.
    """

    label: str
    x: ArrayLike
    y: ArrayLike
    style: Literal["line", "dashed", "points"] = "points"
    y_high: ArrayLike | None = None
    color: int | None = None


class Plot(NamedTuple):
    """One picture of the report; `name` is that of its file, without ending."""

    name: str
    title: str
    x_label: str
    y_label: str
    curves: tuple[Series, ...]
    logarithmic: bool = False


@dataclass(frozen=True, kw_only=True)
class Result:
    """Outcome of an experiment; `remarks` are what only the run can tell, such as how many parcels there were."""

    checks: tuple[Check, ...]
    tables: tuple[Table, ...] = ()
    plots: tuple[Plot, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def missed(self) -> tuple[Check, ...]:
        """The values outside of their gates."""
        return tuple(check for check in self.checks if not check.passed)

    def as_dict(self) -> dict[str, Any]:
        """Return checks and tables as plain values."""
        checks = [{**asdict(c), "passed": c.passed, "missed_by": c.missed_by} for c in self.checks]
        return {"passed": not self.missed, "checks": checks, "tables": [table._asdict() for table in self.tables]}


def number_text(value: float | str) -> str:
    """Return a number with three significant digits, plain from 0.001 to 100,000; words as they are."""
    if isinstance(value, str):
        return value
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    if not 1e-3 <= abs(value) < 1e5:
        return f"{value:.2g}"
    text = f"{value:.{max(0, 2 - math.floor(math.log10(abs(value))))}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text
