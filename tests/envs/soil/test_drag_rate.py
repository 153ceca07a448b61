"""How much a drag brings into the bucket hardly depends on its speed; slower ones: the experiment drag_rate."""

import math

import numpy as np

from bench.soil import tool_at
from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil.soil import Soil

DEPTH, WAY = 0.2, 1.2


def payload_kg(speed_m_s):
    """Drag the bucket through level ground; return what is in it at the end."""
    soil = Soil(fidelity="fast")
    soil.reset(np.full((120, 120), 0.8))
    velocity = np.array([-speed_m_s, 0.0, 0.0])
    for tick in range(round(WAY / speed_m_s / TICK_S) + 1):
        edge = np.array([0.5 * WAY, 0.0, 0.8 - DEPTH]) + tick * TICK_S * velocity
        soil.step(TICK_S, tool_at(edge, math.radians(-105.0), velocity, 0.0))
    return soil.payload_mass_kg


def test_a_slow_drag_brings_as_much_sand_as_a_quick_one():
    loads = np.array([payload_kg(speed) for speed in (0.4, 1.6)])
    np.testing.assert_allclose(loads, loads.mean(), rtol=0.1)
