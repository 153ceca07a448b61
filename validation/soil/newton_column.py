"""A collapsing column in Newton's implicit material point method, on the CPU.

Newton (https://github.com/newton-physics/newton, Apache-2.0) is not a dependency of this package: install it beside it.
"""

import math
import time
from typing import NamedTuple

import numpy as np

from validation import Array

VOXEL_M = 0.1
POINTS_PER_VOXEL = 2
"""Along each axis. With a voxel of 0.0625 m the run-out of a low column hardly changed."""

STEP_S = 0.02
_WARM_UP_STEPS = 2  # they compile
_SETTLED_S = 2.0


class NewtonColumn(NamedTuple):
    """One collapse."""

    run_out: float  # (r - r0) / r0 of the radius that holds a share of the points
    height: float  # final height over initial radius
    point_count: int
    cpu_s_per_s: float  # CPU seconds per simulated second, compilation left out


def is_installed() -> bool:
    """Tell whether Newton can be imported."""
    try:
        import newton
    except ImportError:
        return False
    return newton is not None


def collapse_in_newton(
    *, radius_m: float, height_m: float, friction: float, density_kg_m3: float, share: float, seed: int
) -> NewtonColumn:
    """Release a column on a plane of the same friction coefficient and follow it for two seconds.

    The seed displaces the material points a little.
    """
    import newton
    import warp
    from newton.solvers import SolverImplicitMPM

    points = _points(radius_m, height_m, np.random.default_rng(seed))
    builder = newton.ModelBuilder()
    SolverImplicitMPM.register_custom_attributes(builder)
    mass_kg = density_kg_m3 * math.pi * radius_m**2 * height_m / len(points)
    builder.add_particles(
        pos=[warp.vec3(*point) for point in points.tolist()],
        vel=[warp.vec3(0.0, 0.0, 0.0)] * len(points),
        mass=[mass_kg] * len(points),
        radius=[0.5 * VOXEL_M / POINTS_PER_VOXEL] * len(points),
    )
    builder.add_ground_plane(cfg=newton.ModelBuilder.ShapeConfig(mu=friction))
    model = builder.finalize()
    model.set_gravity((0.0, 0.0, -9.81))
    model.mpm.friction.fill_(friction)
    config = SolverImplicitMPM.Config()
    config.voxel_size = VOXEL_M
    solver = SolverImplicitMPM(model, config=config)
    now, following = model.state(), model.state()
    steps, start = round(_SETTLED_S / STEP_S), 0.0
    for number in range(steps):
        if number == _WARM_UP_STEPS:
            start = time.process_time()
        solver.step(now, following, None, None, STEP_S)
        solver.project_outside(following, following, STEP_S)
        now, following = following, now
    found = now.particle_q.numpy()
    return NewtonColumn(
        run_out=float(np.quantile(np.hypot(found[:, 0], found[:, 1]), share)) / radius_m - 1.0,
        height=float(found[:, 2].max()) / radius_m,
        point_count=len(points),
        cpu_s_per_s=(time.process_time() - start) / ((steps - _WARM_UP_STEPS) * STEP_S),
    )


def _points(radius_m: float, height_m: float, rng: np.random.Generator) -> Array:
    """Return (n, 3) points of a lattice inside the column [m], each displaced a little."""
    spacing = VOXEL_M / POINTS_PER_VOXEL
    count, layers = math.ceil(radius_m / spacing), max(1, round(height_m / spacing))
    level = (np.arange(-count, count) + 0.5) * spacing
    x, y, z = np.meshgrid(level, level, (np.arange(layers) + 0.5) * height_m / layers, indexing="ij")
    points = np.stack([x, y, z], axis=-1)[np.hypot(x, y) <= radius_m]
    points[:, :2] += rng.uniform(-0.2, 0.2, (len(points), 2)) * spacing
    return np.asarray(points)
