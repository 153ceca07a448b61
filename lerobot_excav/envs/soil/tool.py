"""The digging tool as the soil sees it, and what the soil answers."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.patches import Patches
from lerobot_excav.errors import require

_CONVEX_TOLERANCE_M2 = 1e-9


def _fixed(value: ArrayLike, shape: tuple[int, ...], name: str) -> Array:
    """Return a read-only float64 copy of the right shape with finite values."""
    array = np.array(value, dtype=np.float64)
    require(array.shape == shape, f"{name} has shape {array.shape}; allowed: {shape}.")
    require(bool(np.isfinite(array).all()), f"{name}={array.tolist()} is not finite; check the machine's state.")
    array.flags.writeable = False
    return array


@dataclass(frozen=True, kw_only=True, eq=False)
class ToolGeometry:
    """Inner shape of a bucket: one cross-section, the same over the whole inner width.

    Attributes:
        profile_t: (n, 2) points (x_t, z_t) [m] from the cutting edge along bottom and back to the back lip.
            The opening is the straight line from lip to edge. Convex, counter-clockwise, z_t >= 0.
        inner_width_m: Distance between the side plates, which stand at y_t = +-inner_width_m / 2.

    Raises:
        ConfigurationError: The profile is not such a polyline, or the width is not positive.
    """

    profile_t: Array
    inner_width_m: float

    def __post_init__(self) -> None:
        points = np.asarray(self.profile_t, dtype=np.float64)
        require(
            points.ndim == 2 and points.shape[1:] == (2,) and len(points) >= 3,
            f"profile_t has shape {points.shape}; allowed: (n, 2) with n >= 3.",
        )
        object.__setattr__(self, "profile_t", _fixed(points, points.shape, "profile_t"))
        require(
            0.0 < self.inner_width_m < np.inf, f"inner_width_m={self.inner_width_m!r}; allowed: above 0 and finite."
        )
        require(bool((points[:, 1] >= -1e-9).all()), "profile_t has z_t < 0; the shell lies on the +z side.")
        side = np.roll(points, -1, axis=0) - points
        following = np.roll(side, -1, axis=0)
        turn = side[:, 0] * following[:, 1] - side[:, 1] * following[:, 0]
        require(
            bool((turn > -_CONVEX_TOLERANCE_M2).all()),
            f"profile_t={points.tolist()} is not convex and counter-clockwise; "
            "list it from the cutting edge over bottom and back to the lip, bulging outwards only.",
        )
        require(
            bool((np.abs(side).max(axis=1) > 0.0).all()),
            f"profile_t={points.tolist()} lists the same point twice in a row (the last one meets the first); "
            "leave one out.",
        )
        require(
            self.struck_volume_m3 > 0.0,
            f"profile_t={points.tolist()} holds no volume; its points must not lie on one line.",
        )

    def has_shape_of(self, other: "ToolGeometry") -> bool:
        """Tell whether another geometry describes the same bucket."""
        return self is other or (
            self.inner_width_m == other.inner_width_m and np.array_equal(self.profile_t, other.profile_t)
        )

    @cached_property
    def planes_t(self) -> Array:
        """Return (m, 4) half-spaces n . q <= d of the inside: opening, plates from edge to lip, right, left."""
        ends = np.roll(self.profile_t, -1, axis=0)
        along = ends - self.profile_t
        length = np.linalg.norm(along, axis=1)
        normal = np.stack([along[:, 1], -along[:, 0]], axis=1) / length[:, None]
        offset = np.einsum("ij,ij->i", normal, self.profile_t)
        planes = np.zeros((len(normal) + 2, 4))
        planes[:-2, 0], planes[:-2, 2], planes[:-2, 3] = normal[:, 0], normal[:, 1], offset
        planes[:-2] = np.roll(planes[:-2], 1, axis=0)  # the last side, lip to edge, is the opening
        planes[-2:, 1] = (-1.0, 1.0)
        planes[-2:, 3] = 0.5 * self.inner_width_m
        return planes

    @cached_property
    def corners_t(self) -> Array:
        """Return the (2 n, 3) corners of the inside [m]."""
        half = 0.5 * self.inner_width_m
        x, z = self.profile_t[:, 0], self.profile_t[:, 1]
        return np.concatenate([np.stack([x, np.full_like(x, y), z], axis=1) for y in (-half, half)])

    @cached_property
    def struck_volume_m3(self) -> float:
        """Volume below the opening [m3]."""
        x, z = self.profile_t[:, 0], self.profile_t[:, 1]
        area = 0.5 * float(np.sum(x * np.roll(z, -1) - np.roll(x, -1) * z))
        return area * self.inner_width_m

    @cached_property
    def centroid_t(self) -> Array:
        """Return the (3,) centroid of the volume below the opening [m]."""
        x, z = self.profile_t[:, 0], self.profile_t[:, 1]
        cross = x * np.roll(z, -1) - np.roll(x, -1) * z
        centre = [float(np.sum((c + np.roll(c, -1)) * cross) / (3.0 * np.sum(cross))) for c in (x, z)]
        return np.array([centre[0], 0.0, centre[1]])


@dataclass(frozen=True, kw_only=True, eq=False)
class Tool:
    """Pose and velocity of a rigid bucket.

    Attributes:
        geometry: Its inner shape.
        position_w: (3,) tool origin, the bucket pin [m].
        rotation_w: (3, 3) rotation; columns are the tool's axes in the world.
        linear_velocity_w: (3,) velocity of the origin [m/s].
        angular_velocity_w: (3,) angular velocity [rad/s].

    Raises:
        ConfigurationError: A shape is wrong, a value is not finite, or the matrix is no rotation.
    """

    geometry: ToolGeometry
    position_w: Array
    rotation_w: Array
    linear_velocity_w: Array
    angular_velocity_w: Array

    def __post_init__(self) -> None:
        for name in ("position_w", "linear_velocity_w", "angular_velocity_w"):
            object.__setattr__(self, name, _fixed(getattr(self, name), (3,), name))
        object.__setattr__(self, "rotation_w", _fixed(self.rotation_w, (3, 3), "rotation_w"))
        error = float(np.abs(self.rotation_w.T @ self.rotation_w - np.eye(3)).max())
        require(error < 1e-6, f"rotation_w is off orthonormal by {error:.2g}; allowed: 1e-6.")
        first, second, third = self.rotation_w.T
        require(
            float(np.dot(np.cross(first, second), third)) > 0.0,
            f"rotation_w={self.rotation_w.tolist()} is a reflection; its columns must be right-handed axes.",
        )

    @classmethod
    def of_machine(cls, geometry: ToolGeometry, rotation_w: Array, **vectors_w: Array) -> "Tool":
        """Return a tool whose pose and velocity a simulated machine has computed; they are neither copied nor checked.

        `vectors_w` are the other fields by name. To be used where the machine itself watches over its state: the
        checks of the constructor cost more than many a step of the soil.
        """
        tool = object.__new__(cls)
        tool.__dict__.update(geometry=geometry, rotation_w=rotation_w, **vectors_w)
        return tool

    @property
    def pitch_rad(self) -> float:
        """Angle of the tool's x axis above the horizontal, in its own x-z plane, in (-pi, pi].

        0 has the shell on top (dumping), -pi/2 points the edge down, +-pi has the opening on top (carrying).
        A small roll of the tool is left out of it.
        """
        return float(np.arctan2(self.rotation_w[2, 0], self.rotation_w[2, 2]))


@dataclass(frozen=True, kw_only=True, eq=False)
class Reaction:
    """What the soil does to the tool in one step.

    Attributes:
        force_w_n: (3,) digging resistance [N] at the tool's present velocity, if nothing hinders its motion; the
            weight of the payload is not in it.
        torque_w_nm: (3,) its torque about the tool origin [N m].
        payload_mass_kg: Mass of the soil in the bucket.
        payload_com_t: (3,) its centre of mass [m]; the centroid of the bucket while that is empty.
        patches: What the soil can hold against any other motion, for a machine that solves for its own.
        impulse_w_ns: (3,) what falling and sliding soil gave to the tool in this step [N s], beyond a payload that is
            welded to it, whose weight and inertia the machine carries. Soil that joins the payload is taken to be at
            rest: the machine gives it its momentum, and what fell in brings its own here.
        angular_impulse_w_nms: (3,) the same about the tool origin [N m s].
    """

    force_w_n: Array
    torque_w_nm: Array
    payload_mass_kg: float
    payload_com_t: Array
    patches: Patches
    impulse_w_ns: Array = field(default_factory=lambda: np.zeros(3))
    angular_impulse_w_nms: Array = field(default_factory=lambda: np.zeros(3))

    def with_impulse(self, impulse: Array) -> "Reaction":
        """Return the same with an impulse (6,): linear [N s], and angular about the tool origin [N m s]."""
        return Reaction(
            force_w_n=self.force_w_n,
            torque_w_nm=self.torque_w_nm,
            payload_mass_kg=self.payload_mass_kg,
            payload_com_t=self.payload_com_t,
            patches=self.patches,
            impulse_w_ns=impulse[:3],
            angular_impulse_w_nms=impulse[3:],
        )

    @classmethod
    def free(cls, payload_mass_kg: float, payload_com_t: Array) -> "Reaction":
        """Return the reaction of soil that the tool does not touch."""
        return cls(
            force_w_n=np.zeros(3),
            torque_w_nm=np.zeros(3),
            payload_mass_kg=payload_mass_kg,
            payload_com_t=payload_com_t,
            patches=Patches.none(),
        )
