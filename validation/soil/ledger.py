"""No kilogram appears or vanishes."""

import math

from bench.soil import pile
from validation.soil.dig_runs import cases, dig
from validation.soil.experiment import Conditions, experiment, track
from validation.soil.results import Check, Result, Table

TOLERANCE_KG = 1e-6


@experiment(
    name="ledger",
    title="Mass ledger",
    source="Conservation of mass",
    measures="Grid, parcels, bucket, box and out of bounds are added up after every step of a dig cycle with a dump "
    "into the box, for every soil and fidelity.",
    gate="the sum is constant to 1e-6 kg in every step; no entry and no height is ever negative",
)
def run(conditions: Conditions) -> Result:
    """Add the ledger up after every step of a dig cycle, for every soil and fidelity."""
    rows: list[tuple[float | str, ...]] = []
    worst, lowest, least = 0.0, math.inf, math.inf
    for preset, fidelity in track(cases(conditions), "ledgers"):
        soil = pile(preset, fidelity, conditions.seeds[0])
        total, error = sum(soil.ledger_kg().values()), 0.0
        for _ in dig(soil, quick=conditions.quick):
            entries = soil.ledger_kg().values()
            error = max(error, abs(sum(entries) - total))
            least = min(least, *entries)
            lowest = min(lowest, float(soil.heights_m.min()))
        worst = max(worst, error)
        rows.append((preset, fidelity, total, error, *soil.ledger_kg().values()))
    header = ("soil", "fidelity", "total [kg]", "error [kg]", *(f"{name} [kg]" for name in soil.ledger_kg()))
    return Result(
        checks=(
            Check("greatest error of the sum", worst, "kg", high=TOLERANCE_KG),
            Check("smallest entry", least, "kg", low=0.0),
            Check("lowest column", lowest, "m", low=0.0),
        ),
        tables=(Table(header, tuple(rows)),),
    )
