"""The looks of the machine, and the shapes with which it collides."""

from itertools import pairwise
from typing import Any

import numpy as np

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.envs.soil.plates import PLATE_THICKNESS_M

_BOX = mujoco.mjtGeom.mjGEOM_BOX
_CYLINDER = mujoco.mjtGeom.mjGEOM_CYLINDER

# Bits of contype and conaffinity: the working end meets surroundings and carrier, never itself.
WORKING_BIT = 1
SURROUNDINGS_BIT = 2

_HARD = {"friction": [const.CONTACT_FRICTION, 0.005, 0.0001]}
STANDING: dict[str, Any] = {"contype": SURROUNDINGS_BIT, "conaffinity": WORKING_BIT, **_HARD}
WORKING: dict[str, Any] = {"contype": WORKING_BIT, "conaffinity": SURROUNDINGS_BIT, **_HARD}
UNTOUCHED: dict[str, Any] = {"contype": 0, "conaffinity": 0}
"""Arguments of `add_geom` for what the working end meets, for the working end itself, and for what is only drawn."""

# Groups of geoms and skins, by which the renderer hides things.
SURROUNDINGS_GROUP = 0
MACHINE_GROUP = 1
LOOSE_SOIL_GROUP = 2
COLLISION_GROUP = 3  # never drawn
HIDDEN_GROUP = 4  # nor is this

Vec = tuple[float, float, float]

_MATERIALS: dict[str, tuple[Vec, float]] = {
    "machine": ((0.96, 0.70, 0.08), 0.25),
    "dark": ((0.16, 0.16, 0.17), 0.1),
    "glass": ((0.22, 0.30, 0.36), 0.6),
    "steel": ((0.62, 0.63, 0.65), 0.4),
    "bucket": ((0.34, 0.34, 0.36), 0.2),
    "box": ((0.20, 0.38, 0.58), 0.1),
    "box_floor": ((0.12, 0.22, 0.34), 0.0),
    "ground": ((0.47, 0.50, 0.42), 0.0),
}
"""Colour and specular of every material; `Appearance` overrides machine, box and ground."""


def add_materials(spec: mujoco.MjSpec) -> None:
    """Add the materials that geoms name, without any reflection (which would draw the scene twice)."""
    for name, (rgb, specular) in _MATERIALS.items():
        spec.add_material(name=name, rgba=[*rgb, 1.0], specular=specular, shininess=0.4, reflectance=0.0)


def dress_undercarriage(body: mujoco.MjsBody) -> None:
    """Draw crawler tracks, frame and dozer blade; the tracks stop the bucket."""
    for side in (-1.0, 1.0):
        y = 0.88 * side
        _box(body, (0.0, y, 0.36), (1.05, 0.23, 0.34), "dark", stops=True)
        for x in (-1.05, 1.05):
            _cylinder_across(body, (x, y, 0.36), 0.34, 0.23, "dark")
            _cylinder_across(body, (x, y, 0.36), 0.22, 0.25, "machine")
        _box(body, (0.0, y, 0.36), (0.80, 0.25, 0.10), "machine")
        _box(body, (1.55, 0.55 * side, 0.34), (0.30, 0.07, 0.08), "machine")
    _box(body, (0.0, 0.0, 0.45), (0.60, 0.70, 0.16), "machine")
    _box(body, (1.85, 0.0, 0.28), (0.06, 1.10, 0.24), "machine", stops=True)
    body.add_geom(type=_CYLINDER, pos=[0.0, 0.0, 0.70], size=[0.55, 0.08, 0.0], **_look("dark"), **UNTOUCHED)


def dress_house(body: mujoco.MjsBody) -> None:
    """Draw deck, engine hood, counterweight, cab and boom bracket; none of them collides."""
    _box(body, (-0.30, 0.0, 0.14), (1.10, 1.08, 0.12), "machine")
    _box(body, (-0.45, -0.52, 0.56), (0.75, 0.54, 0.30), "machine")
    _box(body, (-0.55, 0.52, 0.50), (0.55, 0.54, 0.24), "machine")
    _box(body, (-1.28, 0.0, 0.52), (0.20, 1.02, 0.42), "dark")
    _box(body, (-0.45, -1.065, 0.62), (0.50, 0.01, 0.12), "dark")
    _box(body, (0.40, 0.64, 0.46), (0.56, 0.42, 0.24), "machine")
    _box(body, (0.38, 0.64, 1.12), (0.52, 0.40, 0.46), "glass")
    _box(body, (0.36, 0.64, 1.62), (0.58, 0.44, 0.05), "machine")
    for x in (-0.14, 0.88):
        for y in (0.25, 1.03):
            _box(body, (x, y, 1.12), (0.04, 0.03, 0.46), "machine")
    _box(body, (0.72, 0.0, 0.24), (0.22, 0.20, 0.20), "dark")


def dress_boom(body: mujoco.MjsBody) -> None:
    """Draw the bent boom: two beams that meet above the chord."""
    knee = (1.70, 0.52)
    _beam(body, (0.0, 0.0), knee, 0.17, 0.15, "machine")
    _beam(body, knee, (const.BOOM_LENGTH_M, 0.0), 0.15, 0.14, "machine")
    _cylinder_across(body, (knee[0], 0.0, knee[1]), 0.175, 0.148, "machine")
    _cylinder_across(body, (0.0, 0.0, 0.0), 0.14, 0.20, "dark")
    _cylinder_across(body, (const.BOOM_LENGTH_M, 0.0, 0.0), 0.15, 0.18, "dark")


def dress_arm(body: mujoco.MjsBody) -> None:
    """Draw the arm with the horn behind its pin on which the arm cylinder pulls."""
    _beam(body, (-0.42, 0.14), (0.25, 0.10), 0.15, 0.12, "machine")
    _beam(body, (0.10, 0.09), (const.ARM_LENGTH_M, 0.0), 0.12, 0.12, "machine")
    _cylinder_across(body, (const.ARM_LENGTH_M, 0.0, 0.0), 0.11, 0.17, "dark")


def dress_bucket(spec: mujoco.MjSpec, body: mujoco.MjsBody) -> None:
    """Build the bucket from plates along its profile, two cheeks, hinge ears and four teeth."""
    half_plate = PLATE_THICKNESS_M / 2
    half_width = const.BUCKET_INNER_WIDTH_M / 2
    points = [np.array(p) for p in const.BUCKET_PROFILE_T]
    for i, (start, end) in enumerate(pairwise(points)):
        along = (end - start) / np.linalg.norm(end - start)
        outward = half_plate * np.array([along[1], -along[0]])  # the profile runs with the inside to its left
        _beam(
            body, tuple(start + outward), tuple(end + outward), half_plate, half_width + 2 * half_plate,
            "bucket", name=f"bucket_plate_{i}",
        )  # fmt: skip
    for side, name in ((-1.0, "right"), (1.0, "left")):
        _add_cheek(spec, body, f"bucket_cheek_{name}", side * (half_width + half_plate))
        _box(body, (0.12, 0.16 * side, 0.16), (0.19, 0.025, 0.17), "bucket")
    inward = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
    under = 0.03 * np.array([inward[1], -inward[0]])
    for y in np.linspace(-half_width + 0.04, half_width - 0.04, 4):
        _beam(
            body, tuple(points[0] + 0.5 * under), tuple(points[0] + 0.20 * inward + under), 0.022, 0.04,
            "steel", y=float(y), collides=False,
        )  # fmt: skip


def add_cylinders(spec: mujoco.MjSpec) -> None:
    """Draw the hydraulic cylinders as tendons, which follow the joints by themselves and carry no force."""
    anchors = {
        "boom": (("house", (1.02, 0.0, 0.12)), ("boom", (1.62, 0.0, 0.36))),
        "arm": (("boom", (1.45, 0.0, 0.74)), ("arm", (-0.38, 0.0, 0.24))),
        "bucket": (("arm", (-0.02, 0.0, 0.30)), ("arm", (1.28, 0.0, 0.26))),
        "bucket_link": (("arm", (1.28, 0.0, 0.26)), ("bucket", (0.10, 0.0, 0.30))),
    }
    for name, ends in anchors.items():
        tendon = spec.add_tendon(
            name=f"{name}_cylinder", width=0.055, rgba=[0.55, 0.56, 0.58, 1.0], group=MACHINE_GROUP
        )
        for i, (body_name, pos) in enumerate(ends):
            site = f"{name}_cylinder_{i}"
            spec.body(body_name).add_site(name=site, pos=list(pos), group=5)
            tendon.wrap_site(site)


def _look(material: str) -> dict[str, Any]:
    return {"material": material, "mass": 0.0, "group": MACHINE_GROUP}


def _box(body: mujoco.MjsBody, pos: Vec, half_size: Vec, material: str, *, stops: bool = False) -> None:
    """Add a box that stops the working end, or is only drawn."""
    bits = {"contype": SURROUNDINGS_BIT, "conaffinity": WORKING_BIT} if stops else UNTOUCHED
    body.add_geom(type=_BOX, pos=list(pos), size=list(half_size), **_look(material), **bits)


def _cylinder_across(body: mujoco.MjsBody, pos: Vec, radius: float, half_width: float, material: str) -> None:
    """Draw a cylinder whose axis runs along y."""
    shape = {"size": [radius, half_width, 0.0], "quat": [0.5**0.5, 0.5**0.5, 0.0, 0.0]}
    body.add_geom(type=_CYLINDER, pos=list(pos), **shape, **_look(material), **UNTOUCHED)


def _beam(
    body: mujoco.MjsBody,
    start_xz: tuple[float, float],
    end_xz: tuple[float, float],
    half_height: float,
    half_width: float,
    material: str,
    *,
    name: str = "",
    y: float = 0.0,
    collides: bool = True,
) -> None:
    """Add a box along a line in the x-z plane."""
    start, end = np.array(start_xz), np.array(end_xz)
    half_length = 0.5 * float(np.linalg.norm(end - start))
    half_angle = 0.5 * float(np.arctan2(end[1] - start[1], end[0] - start[0]))
    x, z = 0.5 * (start + end)
    shape = {
        "size": [half_length, half_width, half_height],
        "quat": [np.cos(half_angle), 0.0, -np.sin(half_angle), 0.0],
    }
    kind = WORKING if collides else UNTOUCHED
    body.add_geom(name=name, type=_BOX, pos=[x, y, z], **shape, **_look(material), **kind)


def _add_cheek(spec: mujoco.MjSpec, body: mujoco.MjsBody, name: str, y: float) -> None:
    """Add a side plate: the convex profile, extruded by the plate's thickness."""
    half_plate = PLATE_THICKNESS_M / 2
    points = [(x, side * half_plate, z) for side in (-1.0, 1.0) for x, z in const.BUCKET_PROFILE_T]
    convex = mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX
    spec.add_mesh(name=name, uservert=np.array(points).ravel(), inertia=convex).smoothnormal = False
    mesh = mujoco.mjtGeom.mjGEOM_MESH
    body.add_geom(name=name, type=mesh, meshname=name, pos=[0.0, y, 0.0], **_look("bucket"), **WORKING)
