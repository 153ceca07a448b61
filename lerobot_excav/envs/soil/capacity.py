"""How much soil a bucket retains at a pitch, and how a load lies in it.

Seen from the side, in a frame turned by the pitch (u level, v up), a point is retained if

- it is below the free surfaces that rise at the repose angle from the cutting edge, from the back lip and,
  above the opening, from the tops of both side plates, and
- the vertical below it meets the shell, not the opening.

Soil in front of a buried opening holds the load: up to that point the opening counts as closed, and the free
surface starts there instead of at the lower edge. A smaller load lies level below the same surfaces. The
cross-section is cut into vertical strips; across the width every integral is done by hand, so that nothing but
the strips is discretised. For a level opening of length L and width W >= L the heap is
tan(repose) (L^2 W / 4 - L^3 / 12), the SAE J296 heap at tangent 1.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.soil.compiled import kernel
from lerobot_excav.envs.soil.tool import ToolGeometry

Array = NDArray[np.float64]

_STRIPS_PER_PART = 8
_BISECTIONS = 40

_NARROW_M = 1e-6
"""Narrower strips, between corners one above the other, give no point of the drawn surface."""

_U, _FLOOR, _ROOF, _LIMIT, _HEAPS, _WIDTH = range(6)


@dataclass(frozen=True, kw_only=True, eq=False)
class Load:
    """The soil in a bucket.

    Attributes:
        com_t: (3,) centre of mass [m].
        surface_t: (n, 2) polyline (x_t, z_t) of its free surface half-way between the side plates [m].
    """

    com_t: Array
    surface_t: Array


@kernel
def _strip(planes: Array, cos: float, sin: float, u: float) -> tuple[float, float, int, int]:
    """Return floor and roof of the cross-section at u, and the faces there; empty if floor >= roof."""
    low, high, floor_face, roof_face = -math.inf, math.inf, -1, -1
    for k in range(len(planes) - 2):  # the side plates come last
        n_u = planes[k, 0] * cos - planes[k, 2] * sin
        n_v = planes[k, 0] * sin + planes[k, 2] * cos
        rest = planes[k, 3] - n_u * u
        if n_v > 1e-12:
            if rest / n_v < high:
                high, roof_face = rest / n_v, k
        elif n_v < -1e-12:
            if rest / n_v > low:
                low, floor_face = rest / n_v, k
        elif rest < 0.0:
            return 0.0, 0.0, -1, -1
    return low, high, floor_face, roof_face


@kernel
def build_strips(
    profile: Array, planes: Array, slope_tan: float, pitch: float, support: float, per_part: int
) -> Array:
    """Cut the cross-section at a pitch into strips that can hold soil.

    Args:
        profile: (n, 2) points from edge to lip.
        planes: (m, 4) half-spaces of the bucket.
        slope_tan: Tangent of the repose angle.
        pitch: Angle of x_t above the horizontal [rad].
        support: Closed share of the opening, from its lower edge, in [0, 1].
        per_part: Strips between two neighbouring corners of the cross-section, the end of the support included.

    Returns:
        (n * per_part, 6) rows of u, floor, roof, free-surface limit [m], 1 if the strip can heap above its roof,
        and width [m]; rows with roof = floor hold nothing.
    """
    cos, sin = math.cos(pitch), math.sin(pitch)
    u_all = profile[:, 0] * cos - profile[:, 1] * sin
    v_all = profile[:, 0] * sin + profile[:, 1] * cos
    u_lower, v_lower, u_upper, v_upper = u_all[0], v_all[0], u_all[-1], v_all[-1]
    if v_lower > v_upper:
        u_lower, v_lower, u_upper, v_upper = u_upper, v_upper, u_lower, v_lower
    u_start = u_lower + support * (u_upper - u_lower)
    v_start = v_lower + support * (v_upper - v_lower)
    breaks = np.sort(np.append(u_all, u_start))
    strips = np.zeros(((len(breaks) - 1) * per_part, 6))
    for k in range(len(strips)):
        part = k // per_part
        width = (breaks[part + 1] - breaks[part]) / per_part
        u = breaks[part] + (k % per_part + 0.5) * width
        low, high, floor_face, roof_face = _strip(planes, cos, sin, u)
        closed = support > 0.0 and (u - u_lower) * (u - u_start) <= 0.0
        strips[k, 0], strips[k, 5] = u, width
        if high <= low or (floor_face == 0 and not closed):
            continue
        strips[k, 1], strips[k, 2] = low, high
        if closed:
            strips[k, 3] = high
        else:
            strips[k, 3] = min(v_start + slope_tan * abs(u - u_start), v_upper + slope_tan * abs(u - u_upper))
            strips[k, 4] = 1.0 if roof_face == 0 else 0.0
    return strips


@kernel
def _heap(height: float, width: float, slope_tan: float) -> tuple[float, float]:
    """Return area across the width of a heap between side plates, and its first moment above its foot."""
    if height <= 0.0:
        return 0.0, 0.0
    if 2.0 * height >= slope_tan * width:
        return slope_tan * width**2 / 4.0, slope_tan**2 * width**3 / 24.0
    flank = height / slope_tan
    return height * (width - flank), height**2 * (width - 2.0 * flank) / 2.0 + height**3 / (3.0 * slope_tan)


@kernel
def fill(strips: Array, width: float, slope_tan: float, level: float) -> tuple[float, float, float]:
    """Return volume [m3] and first moments in u and v [m4] of the load below a level."""
    volume, moment_u, moment_v = 0.0, 0.0, 0.0
    for k in range(len(strips)):
        u, low, high = strips[k, 0], strips[k, 1], strips[k, 2]
        top = min(strips[k, 3], level)
        if high <= low or top <= low:
            continue
        inner = min(top, high) - low
        area, moment = inner * width, inner * width * (low + 0.5 * inner)
        if strips[k, 4] > 0.0:
            heap_area, heap_moment = _heap(top - high, width, slope_tan)
            area += heap_area
            moment += heap_area * high + heap_moment
        volume += area * strips[k, 5]
        moment_u += area * strips[k, 5] * u
        moment_v += moment * strips[k, 5]
    return volume, moment_u, moment_v


@kernel
def find_level(strips: Array, width: float, slope_tan: float, volume: float) -> float:
    """Return the level below which a load of this volume lies; above everything if there is more than fits."""
    low, high = math.inf, -math.inf
    for k in range(len(strips)):
        if strips[k, 2] > strips[k, 1]:
            low = min(low, strips[k, 1])
            high = max(high, max(strips[k, 2], strips[k, 3]))
    if not low < high or fill(strips, width, slope_tan, high)[0] <= volume:
        return math.inf
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        if fill(strips, width, slope_tan, middle)[0] < volume:
            low = middle
        else:
            high = middle
    return high


class Capacity:
    """Retention of one bucket for one repose angle.

    Evaluated directly at every call (a few microseconds), so there is no table and no interpolation error.
    """

    def __init__(self, geometry: ToolGeometry, slope_tan: float) -> None:
        """Keep the shape in the form that the kernels take."""
        self.geometry = geometry
        self._profile = np.array(geometry.profile_t)
        self._planes = geometry.planes_t
        self._slope_tan = slope_tan

    def retained_volume(self, pitch_rad: float, support: float = 0.0) -> float:
        """Return the largest volume [m3] that stays in the bucket.

        Args:
            pitch_rad: Angle of the tool's x axis above the horizontal.
            support: Share of the opening, from its lower edge, that soil in front closes, in [0, 1]. It never
                makes the volume smaller, though a closed part of the opening carries no heap.
        """
        return self._best(pitch_rad, support)[1]

    def load(self, volume_m3: float, pitch_rad: float, support: float = 0.0) -> Load:
        """Return how a load of some volume lies in the bucket.

        An empty bucket answers with the centroid of its struck volume and an empty surface. What exceeds the
        retained volume is on its way out: its mass is put at that centroid, and where it is most of the load,
        the surface is drawn as if the opening were closed.
        """
        centroid = self.geometry.centroid_t
        if volume_m3 <= 0.0:
            return Load(com_t=centroid, surface_t=np.zeros((0, 2)))
        strips, _ = self._best(pitch_rad, support)
        level = find_level(strips, self.geometry.inner_width_m, self._slope_tan, volume_m3)
        filled, moment_u, moment_v = self._fill(strips, level)
        com = centroid
        if filled > 0.0:
            lying = self._to_tool(np.array([[moment_u / filled, moment_v / filled]]), pitch_rad)[0]
            share = min(1.0, filled / volume_m3)
            com = share * np.array([lying[0], 0.0, lying[1]]) + (1.0 - share) * centroid
        if filled < 0.5 * volume_m3:
            strips = self._strips(pitch_rad, 1.0)
            level = find_level(strips, self.geometry.inner_width_m, self._slope_tan, volume_m3)
        return Load(com_t=com, surface_t=self._surface(strips, level, pitch_rad))

    def _best(self, pitch_rad: float, support: float) -> tuple[Array, float]:
        """Return strips and the retained volume, with the support if that holds more."""
        strips = self._strips(pitch_rad, 0.0)
        volume = self._fill(strips, math.inf)[0]
        if support > 0.0:
            held = self._strips(pitch_rad, support)
            more = self._fill(held, math.inf)[0]
            if more > volume:
                return held, more
        return strips, volume

    def _strips(self, pitch_rad: float, support: float) -> Array:
        return build_strips(
            self._profile, self._planes, self._slope_tan, pitch_rad, support, _STRIPS_PER_PART
        )

    def _fill(self, strips: Array, level: float) -> tuple[float, float, float]:
        return fill(strips, self.geometry.inner_width_m, self._slope_tan, level)

    def _surface(self, strips: Array, level: float, pitch_rad: float) -> Array:
        top = np.minimum(strips[:, _LIMIT], level)
        roof = strips[:, _ROOF]
        heap = np.minimum(top - roof, 0.5 * self._slope_tan * self.geometry.inner_width_m)
        top = np.where((strips[:, _HEAPS] > 0) & (heap > 0), roof + heap, np.minimum(top, roof))
        holds = (roof > strips[:, _FLOOR]) & (top > strips[:, _FLOOR]) & (strips[:, _WIDTH] > _NARROW_M)
        return self._to_tool(np.stack([strips[holds, _U], top[holds]], axis=1), pitch_rad)

    @staticmethod
    def _to_tool(points: Array, pitch_rad: float) -> Array:
        cos, sin = math.cos(pitch_rad), math.sin(pitch_rad)
        u, v = points[:, 0], points[:, 1]
        return np.stack([cos * u + sin * v, -sin * u + cos * v], axis=1)
