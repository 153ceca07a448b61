"""What an experiment found: gated values, a table, plots."""

import math
from dataclasses import asdict, dataclass
from typing import Any, Literal

from numpy.typing import ArrayLike

Style = Literal["line", "dashed", "points"]


@dataclass(frozen=True)
class Check:
    """One measured value and its gate.

    Attributes:
        name: What was measured.
        value: The value.
        unit: Its unit, empty for a pure number.
        low: Smallest allowed value.
        high: Largest allowed value.
    """

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

    @property
    def gate_text(self) -> str:
        """The gate in words."""
        if self.low == self.high:
            return f"= {number_text(self.low)}"
        if math.isinf(self.low):
            return f"≤ {number_text(self.high)}"
        if math.isinf(self.high):
            return f"≥ {number_text(self.low)}"
        return f"{number_text(self.low)} to {number_text(self.high)}"


@dataclass(frozen=True)
class Table:
    """Values without a gate.

    Attributes:
        header: Column names, units included.
        rows: Cells; numbers are rounded when shown.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[float | str, ...], ...]


@dataclass(frozen=True, eq=False)
class Series:
    """One series of values of a plot.

    Attributes:
        label: Its entry in the legend.
        x: Abscissae.
        y: Ordinates.
        style: How it is drawn.
        y_high: Upper end of a band that starts at `y`; None for points and curves.
        color: Index of its colour, so that theory and measurement of one thing look alike; None for the next one.
    """

    label: str
    x: ArrayLike
    y: ArrayLike
    style: Style = "points"
    y_high: ArrayLike | None = None
    color: int | None = None


@dataclass(frozen=True)
class Plot:
    """One picture of the report.

    Attributes:
        name: Name of its file, without ending.
        title: What it shows.
        x_label: Abscissa with its unit.
        y_label: Ordinate with its unit.
        curves: What is drawn.
        logarithmic: Whether both axes are logarithmic.
    """

    name: str
    title: str
    x_label: str
    y_label: str
    curves: tuple[Series, ...]
    logarithmic: bool = False


@dataclass(frozen=True, kw_only=True)
class Result:
    """Outcome of an experiment.

    Attributes:
        checks: Gated values.
        tables: Values without a gate.
        plots: Pictures.
        remarks: Sentences that only the run can tell, such as how many parcels there were.
    """

    checks: tuple[Check, ...]
    tables: tuple[Table, ...] = ()
    plots: tuple[Plot, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def passed(self) -> bool:
        """Whether every value is inside its gate."""
        return all(check.passed for check in self.checks)

    @property
    def missed(self) -> tuple[Check, ...]:
        """The values outside of their gates."""
        return tuple(check for check in self.checks if not check.passed)

    def as_dict(self) -> dict[str, Any]:
        """Return checks and tables as plain values; an open end of a gate is None."""
        checks = []
        for check in self.checks:
            fields = {key: _finite(value) for key, value in asdict(check).items()}
            checks.append({**fields, "passed": check.passed, "missed_by": _finite(check.missed_by)})
        return {"passed": self.passed, "checks": checks, "tables": [asdict(table) for table in self.tables]}


def number_text(value: float) -> str:
    """Return a number with three significant digits, plain from 0.001 to 100,000."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    if 1e-3 <= abs(value) < 1e5:
        digits = max(0, 2 - math.floor(math.log10(abs(value))))
        text = f"{value:.{digits}f}"
        return text.rstrip("0").rstrip(".") if "." in text else text
    return f"{value:.2g}"


def _finite(value: Any) -> Any:
    return None if isinstance(value, float) and not math.isfinite(value) else value
