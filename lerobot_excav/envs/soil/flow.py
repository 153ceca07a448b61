"""Avalanches: soil that is steeper than its repose angle comes loose, gathers speed, runs out and rests.

Every column has a mobile layer on a static bed. In a sub-step the bed fails where it is too steep (`bed`; firm soil
with cohesion in `standing`), the layer gains and loses speed (`momentum`) and moves through the faces of its columns. A
layer that stands still is bed again. The sub-steps follow from the fastest wave (Courant number 0.6), so times and
run-outs are those of gravity and friction, whatever the cell, the step or the fidelity. What leaves one column enters
another: the mass is exact to rounding. Firm soil that comes loose swells.

A rigid body over a column gives it a ceiling: soil below the ceiling takes no more than fits under it, and soil above
it lies in or on that body and takes no part.
"""

import math

from lerobot_excav.envs.constants import GRAVITY_M_S2
from lerobot_excav.envs.soil.bed import lower_bed
from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.layer import CHANGED, FLOWING, Ground, Layer, Window, active_window, mark_around, wider
from lerobot_excav.envs.soil.momentum import FAST_M_S, THINNEST_M, accelerate
from lerobot_excav.envs.soil.standing import fail_cuts

COURANT = 0.6
"""Way of the fastest wave per sub-step, in cells (tuned: symmetric collapses stay so)."""

_ALMOST_ALL = 1.0 - 1e-9
"""Share of its layer that a column can lose in a sub-step: rounding never makes a height negative."""


@kernel
def _note_beds(layer: Layer, window: Window) -> None:
    """Remember the bed of a window; soil that was taken away from outside takes the bed with it."""
    for i in range(window.i0, window.i1):
        for j in range(window.j0, window.j1):
            if layer.heights[i, j] - layer.bed[i, j] <= THINNEST_M:
                layer.bed[i, j] = layer.heights[i, j]
            layer.firm[i, j] = min(layer.firm[i, j], layer.heights[i, j])
            layer.bed_before[i, j] = layer.bed[i, j]
            layer.support[i, j] = layer.bed[i, j] if layer.heights[i, j] < layer.ceiling[i, j] else math.inf


@kernel
def _join(layer: Layer, ground: Ground, window: Window) -> float:
    """Let the soil that has just come loose swell, and slow the layer down by it; return the speed of the fastest wave.

    Speeds are in m/s.
    """
    fastest = 0.0
    for i in range(window.i0, window.i1):
        for j in range(window.j0, window.j1):
            if layer.bed[i, j] < layer.firm[i, j]:
                layer.heights[i, j] += (ground.swell - 1.0) * (layer.firm[i, j] - layer.bed[i, j])
                layer.firm[i, j] = layer.bed[i, j]
            depth = layer.heights[i, j] - layer.bed[i, j]
            if depth <= THINNEST_M:
                continue
            wave = math.sqrt(GRAVITY_M_S2 * depth)
            joined = layer.bed_before[i, j] - layer.bed[i, j]
            for axis in range(2):
                for side in range(2):
                    a, b = i + side * (1 - axis), j + side * axis
                    if joined > 0.0:  # the columns on both sides of a face do this one after the other
                        layer.speeds[axis, a, b] *= 1.0 - 0.5 * joined / depth
                    fastest = max(fastest, abs(layer.speeds[axis, a, b]) + wave)
    return fastest


@kernel
def _share_out(layer: Layer, ground: Ground, window: Window, dt: float) -> None:
    """Fill in the share of its outflow that each column has soil for, and take all marks away."""
    for i in range(window.i0, window.i1):
        for j in range(window.j0, window.j1):
            layer.active[i, j] = 0
            depth = layer.heights[i, j] - layer.bed[i, j]
            if depth > 0.0:
                east, west = layer.next_speeds[0, i + 1, j], layer.next_speeds[0, i, j]
                north, south = layer.next_speeds[1, i, j + 1], layer.next_speeds[1, i, j]
                along, across = max(east, 0.0) - min(west, 0.0), max(north, 0.0) - min(south, 0.0)
                emptied = dt * (along / ground.dx + across / ground.dy)
                layer.share[i, j] = _ALMOST_ALL / max(emptied, _ALMOST_ALL)


@kernel
def _discharge(layer: Layer, ground: Ground, window: Window, dt: float) -> None:
    """Take over the next speeds, and move the layer with the depth upwind of the faces as far as there is room."""
    nx, ny = layer.heights.shape
    for i in range(window.i0, window.i1 + 1):
        for j in range(window.j0, window.j1 + 1):
            for axis in range(2):
                speed, flux = layer.next_speeds[axis, i, j], 0.0
                if speed != 0.0:
                    p, q = i - 1 + axis, j - axis
                    (a, b), (c, d) = ((p, q), (i, j)) if speed > 0.0 else ((i, j), (p, q))
                    depth = layer.heights[a, b] - layer.bed[a, b]
                    flux = abs(speed) * depth * layer.share[a, b]
                    if 0 <= c < nx and 0 <= d < ny and layer.ceiling[c, d] < math.inf:
                        # a quarter of the room through each of the four faces
                        room = max(0.0, layer.ceiling[c, d] - layer.heights[c, d])
                        flux = min(flux, 0.25 * room / dt * (ground.dx if axis == 0 else ground.dy))
                    speed = math.copysign(flux / depth, speed)  # what is held back does not gather speed
                    layer.next_speeds[axis, i, j] = 0.0
                elif layer.speeds[axis, i, j] != 0.0:  # it has just stopped, perhaps on a slope that it came up
                    mark_around(layer.active, min(i, nx - 1), min(j, ny - 1), FLOWING)
                if abs(speed) > FAST_M_S:
                    layer.crept_s[max(0, i - 2 + axis) : i + 2, max(0, j - 1 - axis) : j + 2] = 0.0
                layer.speeds[axis, i, j] = speed
                layer.flux[axis, i, j] = math.copysign(flux, speed)


@kernel
def _move(layer: Layer, ground: Ground, window: Window, dt: float) -> float:
    """Change the heights by the flux of a time [s]; return the height [m] that ran over the border.

    Columns that moved are marked, and their neighbours, and have crept for so long; a layer that stands still becomes
    bed.
    """
    nx, ny = layer.heights.shape
    over_border = 0.0
    for i in range(window.i0, window.i1):
        for j in range(window.j0, window.j1):
            west, east = layer.flux[0, i, j] * dt / ground.dx, layer.flux[0, i + 1, j] * dt / ground.dx
            south, north = layer.flux[1, i, j] * dt / ground.dy, layer.flux[1, i, j + 1] * dt / ground.dy
            if west == 0.0 and east == 0.0 and south == 0.0 and north == 0.0:
                layer.bed[i, j] = layer.heights[i, j]
                continue
            layer.heights[i, j] += (west - east) + (south - north)
            layer.crept_s[i, j] += dt
            mark_around(layer.active, i, j, FLOWING)
            over_border += (abs(west) if i == 0 else 0.0) + (abs(east) if i == nx - 1 else 0.0)
            over_border += (abs(south) if j == 0 else 0.0) + (abs(north) if j == ny - 1 else 0.0)
    return over_border


@kernel
def _forget_creep(layer: Layer, window: Window) -> None:
    """Forget how long soil has crept in the columns of a window that were changed."""
    for i in range(window.i0, window.i1):
        for j in range(window.j0, window.j1):
            if layer.active[i, j] == CHANGED:
                layer.crept_s[i, j] = 0.0


@kernel
def flow(layer: Layer, ground: Ground, dt: float) -> tuple[float, bool]:
    """Let the soil of the active columns flow for a time [s]; the layer changes in place.

    Returns the height [m] that ran over the border, and whether soil may still move.
    """
    nx, ny = layer.heights.shape
    window, over_border, left = Window(0, nx, 0, ny), 0.0, dt
    if ground.cohesion_m > 0.0:
        fail_cuts(layer, ground, active_window(layer.active, window))
    _forget_creep(layer, window)
    while left > 1e-9 * dt:
        failing = active_window(layer.active, window)
        if failing.i1 == 0:
            return over_border, False
        window = wider(layer.active, failing)  # what comes loose in this sub-step moves into a column more
        _note_beds(layer, window)
        lower_bed(layer, ground, failing)
        fastest = _join(layer, ground, window)
        step = left / max(1, math.ceil(fastest * left / (COURANT * min(ground.dx, ground.dy))))
        accelerate(layer, ground, window, step)
        _share_out(layer, ground, window, step)
        _discharge(layer, ground, window, step)
        over_border += _move(layer, ground, window, step)
        left -= step
    return over_border, active_window(layer.active, window).i1 > 0
