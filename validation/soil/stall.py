"""The soil can hold the machine, but it never drives it."""

import dataclasses
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.machines.excavator.layout import DIG_AREA_EXTENT_M, TARGET_BOX
from lerobot_excav.envs.machines.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.soil import PRESETS, Soil, SoilParameters
from validation import Array
from validation.soil.experiment import Conditions, experiment, track
from validation.soil.results import Check, Plot, Result, Series, Table

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


class Dig(NamedTuple):
    """One dig with the machine, tick by tick."""

    power_w: Array  # of the soil's resistance at the end of the tick
    force_n: Array  # size of the soil's answer
    edge_speed_m_s: Array  # of the cutting edge in the direction in which the arm would move it
    edge_w: Array  # (n, 3) cutting edge after the tick [m]
    phase: Array  # number of the phase

    def during(self, *names: str) -> NDArray[np.bool_]:
        """Return which ticks belong to these phases."""
        return np.isin(self.phase, [k for k, (name, *_) in enumerate(PHASES) if name in names])


def hard_ground(parameters: SoilParameters) -> SoilParameters:
    """Return a soil that stalls the machine: cohesion of a soft rock, and an edge that hardly enters."""
    return dataclasses.replace(parameters, cohesion_pa=1e5, penetration_scale=20.0)


def dig(parameters: SoilParameters, *, fidelity: str) -> Dig:
    """Lower the bucket into level ground, drag, hold, drag on and lift."""
    machine = ExcavatorMachine(container=TARGET_BOX)
    soil = Soil(parameters, DIG_AREA_EXTENT_M, 0.05, fidelity, container=TARGET_BOX)
    soil.reset(np.full(soil.heights_m.shape, GROUND_M))
    machine.reset(START_RAD)
    ticks = []
    for number, (_, command, count) in enumerate(PHASES):
        for _ in range(count):
            ahead, before = _arm_direction(machine), machine.cutting_edge_pos_w
            # Without its load, which has weight and gives its momentum, the resistance is the only force from outside.
            reaction = dataclasses.replace(soil.step(TICK_S, machine.tool()), payload_mass_kg=0.0)
            reaction = reaction.with_impulse(np.zeros(6))
            machine.tick(np.array(command), reaction)
            power = machine.data.qfrc_applied @ machine.data.qvel  # of the soil alone
            edge = machine.cutting_edge_pos_w
            ticks.append((power, np.linalg.norm(reaction.force_w_n), (edge - before) @ ahead / TICK_S, edge, number))
    return Dig(*(np.array(values) for values in zip(*ticks, strict=True)))


def _arm_direction(machine: ExcavatorMachine) -> Array:
    """Return the direction (3,) in which the arm moves the cutting edge when it comes in."""
    jacobian = np.zeros((3, machine.model.nv))
    site = machine.model.site("cutting_edge").id
    mujoco.mj_jacSite(machine.model, machine.data, jacobian, None, site)
    direction: Array = -jacobian[:, ARM] / np.linalg.norm(jacobian[:, ARM])
    return direction


@experiment(
    name="stall",
    title="Stall and energy",
    source="Mechanics: resistance is no drive; friction holds what rests",
    measures="The machine lowers its bucket into level ground, drags it, holds it for 6 s, drags on and lifts: in the "
    "soil, and in ground so hard that it stalls. The load is left out, so that the resistance is the only force from "
    "outside; its power at the end of every tick.",
    gate="the soil never reverses the blade, a bucket held in it stays, and no force puts energy into the machine",
)
def run(conditions: Conditions) -> Result:
    """Dig in the soil and in hard ground."""
    parameters = PRESETS[conditions.preset]
    soils = {conditions.preset: parameters, "hard ground": hard_ground(parameters)}
    digs = {name: dig(soil, fidelity=conditions.fidelity) for name, soil in track(list(soils.items()), "digs")}
    checks, rows = [], []
    for name, one in digs.items():
        checks += _checks(name, one)
        dragged, free = one.during("drag", "drag on"), one.edge_speed_m_s.max()
        slowest = float(one.edge_speed_m_s[one.during("drag on")].mean())
        rows.append((name, float(one.force_n.max()) / 1e3, slowest, float(free), float(one.power_w[dragged].min())))
    speeds = ("mean speed dragging on [m/s]", "greatest speed [m/s]")
    table = Table(("soil", "greatest force [kN]", *speeds, "greatest power taken [W]"), tuple(rows))
    return Result(checks=tuple(checks), tables=(table,), plots=(_plot(digs),))


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
        curves.append(Series(f"speed, {name} [m/s]", seconds, one.edge_speed_m_s, "line", color=k))
        curves.append(Series(f"force, {name} [10 kN]", seconds, one.force_n / 1e4, "dashed", color=k))
    title, y_label = "Lower, drag, hold, drag on, lift", "speed of the edge [m/s]; force [10 kN]"
    return Plot("stall", title, "time [s]", y_label, tuple(curves))
