"""The scripted dig cycle of the soil's benchmark, with what is watched in every step."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bench.soil import cone, dig_cycle
from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.soil import FIDELITIES, PRESETS, Soil
from validation.soil.experiment import Conditions

Array = NDArray[np.float64]

QUICK_TICKS = 150
"""Penetrate and drag only."""


def cases(conditions: Conditions) -> list[tuple[str, str]]:
    """Return soils and fidelities to run: all of them, or if it has to be quick the chosen soil in all fidelities."""
    presets = (conditions.preset,) if conditions.quick else tuple(PRESETS)
    return [(preset, fidelity) for preset in presets for fidelity in FIDELITIES]


def prepared_soil(preset: str, fidelity: str, seed: int) -> Soil:
    """Return a pile with the target box beside it."""
    soil = Soil(preset, (6.0, 6.0), 0.05, fidelity, seed, container=TARGET_BOX)
    soil.reset(cone(soil))
    return soil


def dig(soil: Soil, *, quick: bool) -> Iterator[int]:
    """Step the soil through one cycle: dig, lift, swing, dump over the box; yield the number of every tick."""
    tools = list(dig_cycle())
    for number, tool in enumerate(tools[:QUICK_TICKS] if quick else tools):
        soil.step(TICK_S, tool)
        yield number
