"""One collapsing column of parcels: how far it runs out, how high it stays."""

import dataclasses
import math
from typing import NamedTuple

import numpy as np

from lerobot_excav.envs.constants import GRAVITY_M_S2, TICK_S
from lerobot_excav.envs.soil import PRESETS, Soil, SoilParameters
from validation import Array
from validation.soil.arrangement import cylinder
from validation.soil.resting import steps_until_rest

MASS_SHARE = 0.99
"""Share of the mass within the run-out radius: single parcels roll on for ever."""

RADIUS_M = 0.5
VOLUME_LIMIT_M3 = 0.60
"""Largest column, about 940 parcels at `standard`: all of them may be awake. Taller columns are thinner."""

_TIME_LIMIT_S = 20.0


class Collapse(NamedTuple):
    """One collapse."""

    aspect: float  # initial height over radius, from mass and radius
    run_out: float  # (r - r0) / r0 of the mass radius
    height: float  # final height over initial radius
    stop_time: float  # until the radius is within 2 % of its last value, over sqrt(h0 / g)
    parcel_count: float
    cone_run_out: float  # of the cone at repose of the same volume
    simulated_s: float  # until all of it was at rest


def sand_with_friction(friction_deg: float) -> SoilParameters:
    """Return sand with another friction angle; soil on steel keeps two thirds of it."""
    sand, friction = PRESETS["sand"], math.radians(friction_deg)
    return dataclasses.replace(sand, friction_angle_rad=friction, steel_friction_angle_rad=2.0 / 3.0 * friction)


def collapse(parameters: SoilParameters, aspect: float, *, fidelity: str, seed: int) -> Collapse:
    """Release a column on an empty floor and wait until everything rests; its aspect is met to a layer of parcels."""
    radius = min(RADIUS_M, (VOLUME_LIMIT_M3 / (math.pi * aspect)) ** (1.0 / 3.0))
    soil = Soil(parameters, (6.0, 6.0), 0.05, fidelity, seed)
    points = cylinder(radius, aspect * radius, soil, np.random.default_rng(seed))
    soil.add_parcels(points, np.zeros_like(points))
    height = len(points) * soil.parcel_mass_kg / (soil.density_kg_m3 * math.pi * radius**2)
    steps = steps_until_rest(soil, dt_s=TICK_S, limit_s=_TIME_LIMIT_S)
    radii = np.array([mass_radius(soil, MASS_SHARE) for _ in steps])
    moving = np.flatnonzero(np.abs(radii - radii[-1]) > 0.02 * radii[-1])
    stop = TICK_S * (moving[-1] + 2) if len(moving) else 0.0
    return Collapse(
        aspect=height / radius,
        run_out=float(radii[-1]) / radius - 1.0,
        height=float(soil.heights_m.max()) / radius,
        stop_time=stop / math.sqrt(height / GRAVITY_M_S2),
        parcel_count=len(points),
        cone_run_out=_cone_radius(soil, radius, height) / radius - 1.0,
        simulated_s=TICK_S * len(radii),
    )


def _cone_radius(soil: Soil, radius_m: float, height_m: float) -> float:
    """Return the mass radius [m] of the cone at repose that has the volume of a column."""
    radii_m = np.hypot(*np.meshgrid(soil.x_w, soil.y_w, indexing="ij"))
    slope_tan = soil.parameters.slope_tan
    foot_m = math.cbrt(3.0 * radius_m**2 * height_m / slope_tan)
    cone = np.maximum(0.0, slope_tan * (foot_m - radii_m))
    return share_radius(radii_m.ravel(), cone.ravel(), MASS_SHARE)


def share_radius(radii_m: Array, masses_kg: Array, share: float) -> float:
    """Return the radius [m] that holds a share in (0, 1) of (n,) masses, linear between the sorted (n,) radii."""
    order = np.argsort(radii_m)
    reached = np.cumsum(masses_kg[order])
    return float(np.interp(share * reached[-1], reached, radii_m[order]))


def mass_radius(soil: Soil, share: float) -> float:
    """Return the radius [m] about the z axis that holds a share of the soil on the ground and in parcels."""
    x, y = np.meshgrid(soil.x_w, soil.y_w, indexing="ij")
    heights = soil.heights_m
    total = float(heights.sum())
    cell_kg = soil.ledger_kg()["grid"] / total if total > 0.0 else 0.0
    parcels = soil.parcel_positions_w
    return share_radius(
        np.concatenate([np.hypot(x, y).ravel(), np.hypot(parcels[:, 0], parcels[:, 1])]),
        np.concatenate([heights.ravel() * cell_kg, soil.parcel_masses_kg]),
        share,
    )
