"""The scripted dig cycle of the soil's benchmark, for every soil and fidelity."""

from collections.abc import Iterator

from bench.soil import dig_cycle
from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil import FIDELITIES, PRESETS, Soil
from validation.soil.experiment import Conditions

QUICK_TICKS = 150
"""Penetrate and drag only."""


def cases(conditions: Conditions) -> list[tuple[str, str]]:
    """Return soils and fidelities to run: all of them, or if it has to be quick the chosen soil in all fidelities."""
    presets = (conditions.preset,) if conditions.quick else tuple(PRESETS)
    return [(preset, fidelity) for preset in presets for fidelity in FIDELITIES]


def dig(soil: Soil, *, quick: bool) -> Iterator[int]:
    """Step the soil through one cycle: dig, lift, swing, dump over the box; yield the number of every tick."""
    tools = list(dig_cycle())
    for number, tool in enumerate(tools[:QUICK_TICKS] if quick else tools):
        soil.step(TICK_S, tool)
        yield number
