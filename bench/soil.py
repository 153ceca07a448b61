"""A scripted dig cycle without a machine, and how fast the soil computes it: `python -m bench.soil`."""

import math
import time
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.machines.excavator.bucket import bucket_geometry
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.soil import FIDELITIES, Soil, Tool

Array = NDArray[np.float64]

BUCKET = bucket_geometry()

_KEYFRAMES = (
    # time [s], cutting edge (x, y, z) [m], pitch [deg]
    (0.0, (1.0, 0.0, 1.40), -80.0),
    (1.5, (0.9, 0.0, 0.35), -95.0),  # penetrate
    (4.5, (-0.6, 0.0, 0.40), -125.0),  # drag 1.5 m
    (6.0, (-0.9, 0.0, 0.80), -178.0),  # curl
    (7.0, (-0.9, 0.0, 2.00), -180.0),  # lift
    (10.0, (-3.4, 4.75, 2.20), -180.0),  # swing over the box
    (11.5, (-3.3, 4.75, 2.20), -40.0),  # dump
    (14.0, (-3.3, 4.75, 2.20), -20.0),
)
"""One cycle; the bucket's plane stays along x."""


def cone(soil: Soil, height_m: float = 1.25, slope: float = 0.75) -> Array:
    """Return (nx, ny) heights of a cone in the middle of the dig area; 5.4 t of sand by default."""
    x, y = np.meshgrid(soil.x_w, soil.y_w, indexing="ij")
    return np.asarray(np.clip(height_m - slope * np.hypot(x, y), 0.0, None))


def rotation_at(pitch_rad: float) -> Array:
    """Return the rotation (3, 3) of a tool whose x axis points this far above the world's x axis."""
    cos, sin = math.cos(pitch_rad), math.sin(pitch_rad)
    return np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]])


def tool_at(edge_w: Array, pitch_rad: float, edge_velocity_w: Array, pitch_rate: float) -> Tool:
    """Return the bucket with its cutting edge centre at a point [m] that moves with some velocity [m/s], [rad/s]."""
    rotation = rotation_at(pitch_rad)
    arm = rotation @ np.array([BUCKET.profile_t[0, 0], 0.0, BUCKET.profile_t[0, 1]])
    turning = np.array([0.0, -pitch_rate, 0.0])
    return Tool(
        geometry=BUCKET,
        position_w=edge_w - arm,
        rotation_w=rotation,
        linear_velocity_w=edge_velocity_w - np.cross(turning, arm),
        angular_velocity_w=turning,
    )


def dig_cycle() -> Iterator[Tool]:
    """Yield the bucket at every tick of one cycle: dig in the cone, lift, swing, dump over the box.

    It starts and stops smoothly at every keyframe, as a machine does.
    """
    for (t0, edge0, pitch0), (t1, edge1, pitch1) in pairwise(_KEYFRAMES):
        start, travel = np.array(edge0), np.array(edge1) - np.array(edge0)
        turn = math.radians(pitch1 - pitch0)
        count = round((t1 - t0) / TICK_S)
        for k in range(1, count + 1):
            time = k / count
            share, rate = time * time * (3.0 - 2.0 * time), 6.0 * time * (1.0 - time) / (t1 - t0)
            pitch = math.radians(pitch0) + share * turn
            yield tool_at(start + share * travel, pitch, rate * travel, rate * turn)


class StepTimes(NamedTuple):
    """What was seen of some steps, each (n,)."""

    ms: Array  # computing time
    parcels: Array  # how many there were after it
    awake: Array  # how many of them were awake


def timed_steps(soil: Soil, tools: Sequence[Tool | None]) -> StepTimes:
    """Step a soil with one tool after the other, or without one, and watch it."""
    seen = np.zeros((3, len(tools)))
    for k, tool in enumerate(tools):
        start = time.perf_counter()
        soil.step(TICK_S, tool)
        seen[:, k] = (1e3 * (time.perf_counter() - start), len(soil.parcel_masses_kg), soil.awake_parcel_count)
    return StepTimes(*seen)


def quickest_steps(make_soil: Callable[[], Soil], tools: Sequence[Tool | None], repeats: int = 3) -> StepTimes:
    """Step fresh soils in the same way and keep the quickest run of every step, which nothing else disturbed."""
    runs = [timed_steps(make_soil(), tools) for _ in range(repeats)]
    return runs[0]._replace(ms=np.min([run.ms for run in runs], axis=0))


def pile(preset: str = "sand", fidelity: str = "standard", seed: int = 0, cell_size_m: float = 0.05) -> Soil:
    """Return a cone of soil with the target box beside it."""
    soil = Soil(preset, (6.0, 6.0), cell_size_m, fidelity, seed, container=TARGET_BOX)
    soil.reset(cone(soil))
    return soil


def real_time_factor(seed: int, fidelity: str = "standard") -> dict[str, float]:
    """Time one scripted cycle on this machine; the seed changes the jitter of new parcels, hardly the time.

    Returns:
        `real_time_factor` (simulated over computing time of the cycle); `mean_ms`, `p50_ms`, `p95_ms` and `worst_ms`
        per tick; `idle_ms` per tick at rest without a tool; `mean_parcels`, `most_parcels`, `mean_awake` and
        `most_awake` parcels; and `retained_mass_kg` of the cycle.
    """
    tools = list(dig_cycle())
    timed_steps(pile(fidelity=fidelity, seed=seed), tools)  # loads or compiles the kernels
    soil = pile(fidelity=fidelity, seed=seed)
    ms, parcels, awake = timed_steps(soil, tools)
    retained = soil.box_mass_kg
    timed_steps(soil, [None] * 200)
    idle = timed_steps(soil, [None] * 200)
    values = {
        "real_time_factor": TICK_S * 1e3 / ms.mean(),
        **{"mean_ms": ms.mean(), "p50_ms": np.percentile(ms, 50), "p95_ms": np.percentile(ms, 95)},
        **{"worst_ms": ms.max(), "idle_ms": idle.ms.mean()},
        **{"mean_parcels": parcels.mean(), "most_parcels": parcels.max()},
        **{"mean_awake": awake.mean(), "most_awake": awake.max()},
        "retained_mass_kg": retained,
    }
    return {name: float(value) for name, value in values.items()}


if __name__ == "__main__":
    for name in FIDELITIES:
        for key, value in real_time_factor(0, name).items():
            print(f"{name:10} {key:18} {value:10.2f}")
