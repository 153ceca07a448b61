"""What has to hold after every step, whatever the machine does."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.soil import Reaction, Soil
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv

LEDGER_TOLERANCE_KG = 1e-6
FARTHEST_M = 20.0
"""Nothing is farther from the origin: the machine reaches 9 m, and soil falls down (guess)."""

FASTEST_M_S = 30.0
"""No parcel is faster: the bucket's tip moves at 10 m/s at most, and a fall from 5 m adds as much (guess)."""


class SoundnessCheck:
    """Compares the states of one episode with each other and with what is possible.

    Args:
        env: A freshly reset environment.
    """

    def __init__(self, env: ExcavatorEnv) -> None:
        self._env = env
        self._mass_kg = _mass_kg(env.worksite.soil)

    def problem(self, observation: NDArray[np.floating]) -> str:
        """Return what is wrong now, or an empty string.

        Args:
            observation: `agent_pos` of the last step.
        """
        soil = self._env.worksite.soil
        error_kg = _mass_kg(soil) - self._mass_kg
        # A comparison with a number that is none is false: so is the wrong one here.
        if not abs(error_kg) <= LEDGER_TOLERANCE_KG:
            return f"the ledger is off by {error_kg:.3g} kg: {soil.ledger_kg()}"
        if not np.isfinite(observation).all():
            return f"agent_pos={observation.tolist()} is not finite"
        return (
            _entry_problem(soil)
            or _height_problem(soil)
            or _parcel_problem(soil)
            or _reaction_problem(self._env.worksite.reaction)
        )


def reset_problem(env: ExcavatorEnv) -> str:
    """Return what is wrong after a reset, or an empty string."""
    soil = env.worksite.soil
    if soil.heights_m.tobytes() != env.scene.heights_m.tobytes():
        return "the soil after a reset is not that of the scene"
    if len(soil.parcel_positions_w) or soil.payload_mass_kg or soil.box_mass_kg:
        return f"a reset left soil behind: {soil.ledger_kg()}"
    return ""


def _mass_kg(soil: Soil) -> float:
    return sum(soil.ledger_kg().values())


def _entry_problem(soil: Soil) -> str:
    negative = {place: mass for place, mass in soil.ledger_kg().items() if not mass >= 0.0}
    return f"negative mass: {negative}" if negative else ""


def _height_problem(soil: Soil) -> str:
    fields = {"dig area": soil.heights_m, "box": soil.container_heights_m}
    for name, heights in fields.items():
        if heights is not None and not (heights >= 0.0).all():
            return f"a height of the {name} is negative or not finite: {np.nanmin(heights)}"
    return ""


def _parcel_problem(soil: Soil) -> str:
    most = soil.fidelity.most_awake + int(soil.parcel_is_load.sum())  # a load that wakes comes on top
    if soil.awake_parcel_count > most:
        return f"{soil.awake_parcel_count} parcels are awake; allowed: {most}"
    positions, velocities = soil.parcel_positions_w, soil.parcel_velocities_w
    if not (np.abs(positions) <= FARTHEST_M).all():
        return (
            f"a parcel is not on the worksite: {positions[~(np.abs(positions) <= FARTHEST_M).all(axis=1)][0]}"
        )
    if not (np.abs(velocities) <= FASTEST_M_S).all():
        return f"a parcel is too fast: {velocities[~(np.abs(velocities) <= FASTEST_M_S).all(axis=1)][0]}"
    if not (soil.parcel_masses_kg > 0.0).all():
        return "a parcel has no mass"
    return ""


def _reaction_problem(reaction: Reaction | None) -> str:
    if reaction is None:
        return "the soil did not answer"
    patches = reaction.patches
    values = [
        getattr(reaction, name) for name in ("force_w_n", "torque_w_nm", "payload_mass_kg", "payload_com_t")
    ]
    values += [patches.points_w, patches.normals_w, patches.limits_n, patches.frictions]
    is_finite = all(np.isfinite(value).all() for value in values)
    return "" if is_finite else f"the reaction is not finite: {reaction}"
