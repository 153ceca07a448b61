"""The digging force begins at the surface and grows without a jump."""

import math

import numpy as np

from bench.soil import BUCKET, tool_at
from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil import Soil
from validation import Array
from validation.soil.experiment import Conditions, experiment, track
from validation.soil.results import Check, Plot, Result, Series, Table

RAKES_DEG = (25.0, 35.0, 45.0)
GROUND_M = 1.0
DEEPEST_M, HIGHEST_M = 0.40, 0.05
SPACING_M, QUICK_SPACING_M = 0.002, 0.01
SPEED_M_S = 0.5

JUMP_PER_M = 10.0
"""Steepest allowed rise, as a share of the force at the greatest depth per metre of depth (our own; a force that grows
with the square of the depth rises by 5 per metre at 0.4 m, and a jump has no such bound)."""

_DRAG_W = np.array([-SPEED_M_S, 0.0, 0.0])


def force_at_n(soil: Soil, depth_m: float, rake_deg: float) -> float:
    """Return the force on the bucket [N], dragged level with its bottom plate at a rake, in ground that is reset.

    The depth is that of the cutting edge, negative above the ground.
    """
    first, second = BUCKET.profile_t[0], BUCKET.profile_t[1]
    plate = math.atan2(second[1] - first[1], second[0] - first[0])
    soil.reset(np.full(soil.heights_m.shape, GROUND_M))
    edge = np.array([0.0, 0.0, GROUND_M - depth_m])
    # The bucket is new to the soil in this step, so that it cuts nothing before it is weighed.
    reaction = soil.step(TICK_S, tool_at(edge, math.radians(rake_deg) - plate, _DRAG_W, 0.0))
    return float(np.linalg.norm(reaction.force_w_n))


@experiment(
    name="force_ramp",
    title="Force against digging depth",
    source="Earthmoving and bearing theory; depth ramp of AGX Terrain",
    measures="A bucket 0.72 m wide is dragged through fresh, level ground, from 5 cm above it to 0.4 m below.",
    gate="no force above the surface, continuous at contact and below it",
)
def run(conditions: Conditions) -> Result:
    """Measure the force at every depth from above the ground to 0.4 m."""
    spacing = QUICK_SPACING_M if conditions.quick else SPACING_M
    count = round((DEEPEST_M + HIGHEST_M) / spacing) + 1
    depths = np.asarray(np.linspace(-HIGHEST_M, DEEPEST_M, count), dtype=np.float64)
    soil = Soil(conditions.preset, (4.0, 4.0), 0.05, conditions.fidelity)
    forces = {rake: np.array([force_at_n(soil, float(d), rake) for d in depths]) for rake in track(RAKES_DEG, "rakes")}
    above = max(float(f[depths <= 0.0].max()) for f in forces.values())
    steepest = max(float(np.abs(np.diff(f)).max()) / spacing / float(f[-1]) for f in forces.values())
    contact = max(force_at_n(soil, 1e-4, rake) / float(forces[rake][-1]) for rake in RAKES_DEG)
    return Result(
        checks=(
            Check("force above the surface", above, "N", low=0.0, high=0.0),
            Check("force 0.1 mm below it, share of that at 0.4 m", contact, high=1e-3 * JUMP_PER_M),
            Check("steepest rise, share of that at 0.4 m", steepest, "1/m", high=JUMP_PER_M),
        ),
        tables=(_table(soil),),
        plots=(_plot(depths, forces),),
    )


def _table(soil: Soil) -> Table:
    depths = (0.05, 0.1, 0.2, 0.3, 0.4)
    rows = tuple((rake, *(force_at_n(soil, d, rake) for d in depths)) for rake in RAKES_DEG)
    return Table(("rake [°]", *(f"{d} m [N]" for d in depths)), rows)


def _plot(depths: Array, forces: dict[float, Array]) -> Plot:
    curves = (Series(f"rake {rake:.0f}°", depths, force, style="line") for rake, force in forces.items())
    title, x_label = "Force on a bucket that is dragged level", "depth of the cutting edge [m]"
    return Plot("force_ramp", title, x_label, "force [N]", tuple(curves))
