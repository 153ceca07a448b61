"""The same seed and the same motion give the same bits."""

import hashlib

import numpy as np

from bench.soil import cone, pile
from lerobot_excav.envs.soil import Soil
from validation.soil.dig_runs import cases, dig
from validation.soil.experiment import Conditions, experiment, track
from validation.soil.results import Check, Result, Table


def trace(soil: Soil, *, quick: bool) -> str:
    """Dig one cycle and return a digest of masses, parcels and heights after every step."""
    digest = hashlib.sha256()
    for _ in dig(soil, quick=quick):
        digest.update(np.array(list(soil.ledger_kg().values())).tobytes())
        digest.update(soil.parcel_positions_w.tobytes())
        digest.update(soil.heights_m.tobytes())
    return digest.hexdigest()[:16]


@experiment(
    name="determinism",
    title="Determinism",
    source="Repeatability of an experiment",
    measures="A dig cycle, the same again after a reset, and the same in another soil object, for every soil and "
    "fidelity.",
    gate="bit-equal traces; a reset gives the heights back byte for byte",
)
def run(conditions: Conditions) -> Result:
    """Dig the same cycle in two soils and once more after a reset, for every soil and fidelity."""
    rows: list[tuple[float | str, ...]] = []
    different = unequal = 0
    for preset, fidelity in track(cases(conditions), "repeats"):
        soil = pile(preset, fidelity, conditions.seeds[0])
        first = trace(soil, quick=conditions.quick)
        heights = cone(soil)
        soil.reset(heights)
        unequal += soil.heights_m.tobytes() != heights.tobytes()
        again = trace(soil, quick=conditions.quick)
        other = trace(pile(preset, fidelity, conditions.seeds[0]), quick=conditions.quick)
        different += (again != first) + (other != first)
        rows.append((preset, fidelity, first, again, other))
    return Result(
        checks=(
            Check("runs with another trace", float(different), low=0.0, high=0.0),
            Check("resets with other heights", float(unequal), low=0.0, high=0.0),
        ),
        tables=(Table(("soil", "fidelity", "trace", "after a reset", "in another soil"), tuple(rows)),),
        remarks=(
            "A trace is the start of a SHA-256 over ledger, parcels and heights after every step; it belongs to one "
            "version of the code and to one kind of processor.",
        ),
    )
