"""T15: the soil can hold the machine, but it never drives it."""

import dataclasses
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.machines.excavator.layout import DIG_AREA_EXTENT_M, TARGET_BOX
from lerobot_excav.envs.machines.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.soil import PRESETS, Soil, SoilParameters
from validation.soil.experiment import Conditions, SoilExperiment, track
from validation.soil.results import Check, Plot, Result, Series, Table

Array = NDArray[np.float64]

START_RAD = np.array([0.0, 0.6, -1.2, -0.8])
GROUND_M = 0.6
ARM = 2

PHASES = (
    # name, commands of swing, boom, arm and bucket, ticks
    ("lower", (0.0, -0.5, 0.0, 0.0), 40),
    ("drag", (0.0, 0.0, -0.6, 0.0), 50),
    ("hold", (0.0, 0.0, 0.0, 0.0), 300),
    ("drag on", (0.0, 0.0, -1.0, 0.0), 75),
    ("lift", (0.0, 0.6, 0.0, -0.8), 100),
)

DRIFT_TICKS = 50
"""The bucket's motion while it is held is measured over the last second: before, the servos still make up for what
they lag behind."""

REVERSAL_M_S = 1e-3
DRIFT_M = 1e-3
"""Our own: what counts as no motion."""

POWER_W = 1e-3
"""Our own: what counts as no power, a millionth of that of the machine."""


@dataclass(frozen=True, kw_only=True)
class Dig:
    """One dig with the machine.

    Attributes:
        power_w: Power of the soil's resistance at the end of every tick.
        force_n: Size of the soil's answer in every tick.
        edge_speed_m_s: Speed of the cutting edge in the direction in which the arm would move it.
        edge_w: (n, 3) cutting edge after every tick [m].
        phase: (n,) number of the phase of every tick.
    """

    power_w: Array
    force_n: Array
    edge_speed_m_s: Array
    edge_w: Array
    phase: NDArray[np.int64]

    def during(self, *names: str) -> NDArray[np.bool_]:
        """Return which ticks belong to these phases."""
        return np.isin(self.phase, [k for k, (name, *_) in enumerate(PHASES) if name in names])


def hard_ground(parameters: SoilParameters) -> SoilParameters:
    """Return a soil that stalls the machine: cohesion of a soft rock, and an edge that hardly enters."""
    return dataclasses.replace(parameters, cohesion_pa=1e5, penetration_scale=20.0)


def dig(parameters: SoilParameters, *, fidelity: str) -> Dig:
    """Lower the bucket into level ground, drag, hold, drag on and lift.

    Args:
        parameters: The soil.
        fidelity: Numerical effort.
    """
    machine = ExcavatorMachine(container=TARGET_BOX)
    soil = Soil(parameters, DIG_AREA_EXTENT_M, 0.05, fidelity, container=TARGET_BOX)
    soil.reset(np.full(soil.heights_m.shape, GROUND_M))
    machine.reset(START_RAD)
    powers, forces, speeds, edges, phases = [], [], [], [], []
    for number, (_, command, ticks) in enumerate(PHASES):
        for _ in range(ticks):
            ahead, before = _arm_direction(machine), machine.cutting_edge_pos_w
            # Without its load, the soil's resistance is the only force from outside.
            reaction = dataclasses.replace(soil.step(TICK_S, machine.tool()), payload_mass_kg=0.0)
            machine.tick(np.array(command), reaction)
            edges.append(machine.cutting_edge_pos_w)
            speeds.append(float((edges[-1] - before) @ ahead) / TICK_S)
            powers.append(float(machine.data.qfrc_applied @ machine.data.qvel))  # of the soil alone
            forces.append(float(np.linalg.norm(reaction.force_w_n)))
            phases.append(number)
    return Dig(
        power_w=np.array(powers),
        force_n=np.array(forces),
        edge_speed_m_s=np.array(speeds),
        edge_w=np.array(edges),
        phase=np.array(phases),
    )


def _arm_direction(machine: ExcavatorMachine) -> Array:
    """Return the direction (3,) in which the arm moves the cutting edge when it comes in."""
    jacobian = np.zeros((3, machine.model.nv))
    site = machine.model.site("cutting_edge").id
    mujoco.mj_jacSite(machine.model, machine.data, jacobian, None, site)
    direction: Array = -jacobian[:, ARM] / np.linalg.norm(jacobian[:, ARM])
    return direction


def run(conditions: Conditions) -> Result:
    """Dig in the soil and in hard ground."""
    parameters = PRESETS[conditions.preset]
    soils = {conditions.preset: parameters, "hard ground": hard_ground(parameters)}
    digs = {name: dig(soil, fidelity=conditions.fidelity) for name, soil in track(list(soils.items()), "T15 digs")}
    checks, rows = [], []
    for name, one in digs.items():
        checks += _checks(name, one)
        dragged, free = one.during("drag", "drag on"), one.edge_speed_m_s.max()
        slowest = float(one.edge_speed_m_s[one.during("drag on")].mean())
        rows.append((name, float(one.force_n.max()) / 1e3, slowest, float(free), float(one.power_w[dragged].min())))
    header = (
        *("soil", "greatest force [kN]", "mean speed dragging on [m/s]", "greatest speed [m/s]"),
        "greatest power taken [W]",
    )
    return Result(checks=tuple(checks), tables=(Table(header, tuple(rows)),), plots=(_plot(digs),))


def _checks(name: str, one: Dig) -> list[Check]:
    held = one.edge_w[one.during("hold")][-DRIFT_TICKS:]
    drift = float(np.linalg.norm(held - held[0], axis=1).max())
    backwards = max(0.0, -float(one.edge_speed_m_s[one.during("drag", "drag on")].min()))
    work = float(one.power_w.sum()) * TICK_S
    return [
        Check(f"greatest power of the soil, {name}", float(one.power_w.max()), "W", high=POWER_W),
        Check(f"work of the soil, {name}", work, "J", high=0.0),
        Check(f"speed backwards while dragging, {name}", backwards, "m/s", high=REVERSAL_M_S),
        Check(f"drift while held in the soil, {name}", drift, "m", high=DRIFT_M),
    ]


def _plot(digs: dict[str, Dig]) -> Plot:
    curves = []
    for k, (name, one) in enumerate(digs.items()):
        seconds = TICK_S * np.arange(1, len(one.force_n) + 1)
        force, speed = one.force_n / 1e4, one.edge_speed_m_s
        curves.append(Series(f"speed, {name} [m/s]", seconds, speed, style="line", color=k))
        curves.append(Series(f"force, {name} [10 kN]", seconds, force, style="dashed", color=k))
    return Plot(
        "stall", "Lower, drag, hold, drag on, lift", "time [s]", "speed of the edge [m/s]; force [10 kN]", tuple(curves)
    )


EXPERIMENT = SoilExperiment(
    code="T15",
    title="Stall and energy",
    source="Mechanics: resistance is no drive; friction holds what rests",
    measures="The machine lowers its bucket into level ground, drags it, holds it for 6 s, drags on and lifts: in the "
    "soil, and in ground so hard that it stalls. The load is left out, so that the resistance is the only force from "
    "outside; its power at the end of every tick.",
    gate="the soil never reverses the blade, a bucket held in it stays, and no force puts energy into the machine",
    run=run,
)
