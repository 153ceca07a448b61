"""Parcels in the air obey Newton: fall time, centre of mass, energy."""

import math

import numpy as np

from lerobot_excav.envs.constants import GRAVITY_M_S2, TICK_S
from lerobot_excav.envs.soil import Soil
from validation import Array
from validation.soil.arrangement import cylinder
from validation.soil.experiment import Conditions, experiment, track
from validation.soil.results import Check, Plot, Result, Series, Table

HEIGHTS_M = (0.25, 0.5, 1.0, 2.0)

TIME_TOLERANCE = 0.01
"""Share of the fall time (our own: the law has no tolerance, an integrator has one)."""

DRIFT_TOLERANCE_M = 1e-9
"""Rounding of a centre of mass."""

CLOUD_HEIGHT_M = 2.0
CLOUD_SPEED_1_S = 1.0
"""The cloud contracts at first: every parcel moves towards the axis at this rate times its distance."""


def fall_time_s(height_m: float, *, preset: str, fidelity: str) -> float:
    """Return how long one parcel falls by a height to the floor, from its last position and speed in the air."""
    soil = Soil(preset, (2.0, 2.0), 0.05, fidelity)
    radius = soil.parcel_radius_m
    soil.add_parcels([[0.0, 0.0, height_m + radius]], np.zeros((1, 3)))
    time, left, speed = 0.0, height_m, 0.0
    for tick in range(1, 200):
        soil.step(TICK_S)
        in_the_air = len(soil.parcel_positions_w) > 0 and soil.parcel_positions_w[0, 2] > radius
        if not in_the_air or soil.parcel_velocities_w[0, 2] > -speed:
            break
        time, left = tick * TICK_S, float(soil.parcel_positions_w[0, 2]) - radius
        speed = -float(soil.parcel_velocities_w[0, 2])
    rest = (math.sqrt(speed**2 + 2.0 * GRAVITY_M_S2 * left) - speed) / GRAVITY_M_S2
    return time + rest


def cloud(soil: Soil, rng: np.random.Generator, *, height_m: float) -> None:
    """Add a contracting cylinder of about 190 parcels at rest on the whole, its lowest layer at a height [m]."""
    points = cylinder(0.35, 0.32, soil, rng)
    velocities = np.zeros_like(points)
    velocities[:, :2] = -CLOUD_SPEED_1_S * points[:, :2]
    velocities -= velocities.mean(axis=0)
    points[:, 2] += height_m
    soil.add_parcels(points, velocities)


def centre_of_mass(soil: Soil) -> Array:
    """Return the (3,) centre of mass of all parcels [m]."""
    masses = soil.parcel_masses_kg
    return np.asarray(masses @ soil.parcel_positions_w / masses.sum())


def mechanical_energy_j(soil: Soil) -> float:
    """Return the energy of parcels and columns [J]; a column's mass lies at half of its height."""
    heights = soil.heights_m
    cell_m2 = float((soil.x_w[1] - soil.x_w[0]) * (soil.y_w[1] - soil.y_w[0]))
    weight = soil.density_kg_m3 * GRAVITY_M_S2
    return soil.mechanical_energy_j() + 0.5 * weight * cell_m2 * float((heights**2).sum())


def drift_in_the_air_m(*, preset: str, fidelity: str, seed: int) -> tuple[float, float]:
    """Return horizontal drift and distance from the parabola [m] of the centre of mass of a cloud before it lands."""
    soil = Soil(preset, (4.0, 4.0), 0.05, fidelity, seed)
    cloud(soil, np.random.default_rng(seed), height_m=CLOUD_HEIGHT_M)
    start = centre_of_mass(soil)
    horizontal = vertical = 0.0
    for tick in range(1, 30):
        soil.step(TICK_S)
        moved = centre_of_mass(soil) - start
        horizontal = max(horizontal, float(np.hypot(moved[0], moved[1])))
        vertical = max(vertical, abs(float(moved[2]) + 0.5 * GRAVITY_M_S2 * (tick * TICK_S) ** 2))
    return horizontal, vertical


def energies_of_a_dump_j(*, preset: str, fidelity: str, seed: int) -> Array:
    """Return the energy [J] after every tick while a cloud falls, lands, spreads and comes to rest."""
    soil = Soil(preset, (4.0, 4.0), 0.05, fidelity, seed)
    cloud(soil, np.random.default_rng(seed), height_m=1.0)
    energies = [mechanical_energy_j(soil)]
    for _ in range(300):
        soil.step(TICK_S)
        energies.append(mechanical_energy_j(soil))
    return np.array(energies)


@experiment(
    name="free_fall",
    title="Free fall and dump",
    source="Mechanics: t = √(2h/g); the centre of mass of a cloud is moved by gravity only; friction takes energy",
    measures="Single parcels fall from 0.25 m to 2 m. A contracting cloud of parcels collides with itself in the air "
    "2 m above the ground. Another is dropped from 1 m, lands, spreads and rests.",
    gate="fall time (1 %, our own tolerance); drift of the centre of mass 0; energy never grows",
    reasons={
        "growth of the energy in a step": "Contacts are springs. When a cloud lands they take up energy in one step "
        "and give part of it back in the next; kinetic and potential energy leave out what they hold meanwhile. "
        "Their sum never rises above its start."
    },
)
def run(conditions: Conditions) -> Result:
    """Drop single parcels and clouds."""
    common = {"preset": conditions.preset, "fidelity": conditions.fidelity}
    times = [(h, fall_time_s(h, **common), math.sqrt(2.0 * h / GRAVITY_M_S2)) for h in HEIGHTS_M]
    seeds = conditions.repeats
    drifts = [drift_in_the_air_m(**common, seed=seed) for seed in track(seeds, "clouds in the air")]
    dumps = [energies_of_a_dump_j(**common, seed=seed) for seed in track(seeds, "dumps")]
    drift = max(horizontal for horizontal, _ in drifts)
    time_error = max(abs(found / law - 1.0) for _, found, law in times)
    growth = max(float(np.diff(energies).max()) / float(energies[0]) for energies in dumps)
    above = max(float(energies.max() / energies[0]) - 1.0 for energies in dumps)
    return Result(
        checks=(
            Check("fall time", 100.0 * time_error, "%", high=100.0 * TIME_TOLERANCE),
            Check("horizontal drift of the centre of mass", drift, "m", high=DRIFT_TOLERANCE_M),
            Check("energy above its start, share of it", above, high=1e-9),
            Check("growth of the energy in a step, share of its start", growth, high=1e-9),
        ),
        tables=(
            Table(("height [m]", "fall time [s]", "√(2h/g) [s]"), tuple(times)),
            Table(
                ("seed", "horizontal drift [m]", "distance from the parabola [m]"),
                tuple((str(seed), *drift) for seed, drift in zip(seeds, drifts, strict=True)),
            ),
        ),
        plots=(_plot(dumps[0]),),
    )


def _plot(energies: Array) -> Plot:
    times = TICK_S * np.arange(len(energies))
    curve = Series("parcels and grid", times, energies, "line")
    return Plot("dump_energy", "Energy of a dump", "time [s]", "kinetic and potential energy [J]", (curve,))
