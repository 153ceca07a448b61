"""The looks of arm and gripper for people, around the joint frames; nothing of it weighs or touches anything.

A joint is a white drum around its axis with a dark gap to its neighbour and a domed dark lid, a link a white tube.
Places and lengths are those of the frames, radii by eye from pictures of the arm (kind: guess).
"""

from itertools import pairwise

import numpy as np

from lerobot_excav.envs.machines.fr5 import constants as const
from lerobot_excav.envs.machines.simulator import mujoco

PEOPLE_GROUP = 3
"""Group of what is only for people; the plain arm is in another one, and not drawn with it."""

_CYLINDER, _BOX = mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_BOX
_ELLIPSOID, _CAPSULE = mujoco.mjtGeom.mjGEOM_ELLIPSOID, mujoco.mjtGeom.mjGEOM_CAPSULE

Vec = tuple[float, float, float]

_MATERIALS: dict[str, tuple[Vec, float]] = {
    "shell": ((0.88, 0.89, 0.90), 0.5),
    "joint": ((0.20, 0.22, 0.26), 0.4),
    "metal": ((0.60, 0.62, 0.65), 0.7),
    "rubber": ((0.06, 0.06, 0.07), 0.1),
}
"""Colour and specular of every material."""

_GAP_M = 0.008  # dark ring between two housings
_LID_M = 0.020  # height of a lid's dome

# Radii of the housings of shoulder, elbow and wrists, and of the tubes between them [m].
_SHOULDER, _ELBOW, _WRIST = 0.062, 0.056, 0.045
_UPPER_TUBE, _FORE_TUBE = 0.050, 0.042


def dress_arm(spec: mujoco.MjSpec) -> None:
    """Draw housings, tubes and gripper on the bodies of an arm."""
    for name, (rgb, specular) in _MATERIALS.items():
        spec.add_material(name=name, rgba=[*rgb, 1.0], specular=specular, shininess=0.6, reflectance=0.0)
    base, *links = [spec.body(name) for name in ("base", *(f"link{i}" for i in range(1, 7)))]
    upper_m, fore_m = -const.JOINT_PLACEMENTS[2].xyz[0], -const.JOINT_PLACEMENTS[3].xyz[0]
    shoulder_m, wrist_m = const.JOINT_PLACEMENTS[1].xyz[2], const.JOINT_PLACEMENTS[4].xyz[2]
    _drum(base, (0.0, 0.0, 0.0), (0.0, 0.0, 0.014), 0.078, "metal")
    _drum(base, (0.0, 0.0, 0.014), (0.0, 0.0, 0.072), 0.068, "shell")
    # Shoulder: a turret that turns about the vertical, and the housing of the second joint across its top.
    _housing(links[0], [(0.0, 0.0, 0.072), (0.0, 0.0, shoulder_m)], _SHOULDER)
    _housing(links[0], [(0.0, -0.062, shoulder_m), (0.0, 0.070, shoulder_m)], _SHOULDER, lid=True)
    # The second axis runs along -y of the turret: the upper arm stands beside it.
    _housing(links[1], [(0.0, 0.0, 0.062), (0.0, 0.0, 0.200)], _SHOULDER, lid=True)
    _tube(links[1], (0.0, 0.0, 0.135), (-upper_m, 0.0, 0.135), _UPPER_TUBE)
    _housing(links[1], [(-upper_m, 0.0, 0.064), (-upper_m, 0.0, 0.195)], _ELBOW, lid=True)
    _housing(links[2], [(0.0, 0.0, 0.064 - _GAP_M), (0.0, 0.0, -0.050)], _ELBOW, lid=True, gap=False)
    _tube(links[2], (0.0, 0.0, 0.007), (-fore_m, 0.0, 0.007), _FORE_TUBE)
    _housing(links[2], [(-fore_m, 0.0, 0.050), (-fore_m, 0.0, -0.046)], _WRIST, lid=True, gap=False)
    for link, forwards in ((links[3], 1.0), (links[4], -1.0)):
        _housing(link, [(0.0, 0.0, 0.050), (0.0, 0.0, wrist_m)], _WRIST)
        _housing(
            link, [(0.0, -0.050 * forwards, wrist_m), (0.0, 0.046 * forwards, wrist_m)], _WRIST, lid=True, gap=False
        )
    _housing(links[5], [(0.0, 0.0, 0.050), (0.0, 0.0, 0.092)], 0.043)
    _drum(links[5], (0.0, 0.0, 0.092), (0.0, 0.0, const.FLANGE_OFFSET_M), 0.032, "metal")
    _dress_gripper(spec)


def _dress_gripper(spec: mujoco.MjSpec) -> None:
    """Draw the hand with the rail of its fingers, and two fingers with rubber pads."""
    hand = spec.body("hand")
    rail_m, reach_m = const.HAND_LENGTH_M - 0.016, const.FINGER_STROKE_M + 0.022
    _drum(hand, (0.0, 0.0, 0.0), (0.0, 0.0, 0.012), 0.038, "joint")
    _drum(hand, (0.0, 0.0, 0.012), (0.0, 0.0, rail_m - 0.012), 0.036, "shell")
    _box(hand, (0.0, 0.0, rail_m), (reach_m, 0.021, 0.013), "joint")
    for name, side, width_m in zip(const.FINGER_NAMES, (1.0, -1.0), const.PAD_WIDTH_M, strict=True):
        finger, half_width = spec.body(name), 0.5 * width_m + 0.002
        outside = side * const.PAD_THICKNESS_M
        _box(finger, (outside, 0.0, rail_m + 0.018), (0.012, 0.019, 0.009), "metal")
        top, tip = rail_m + 0.022, const.PAD_CENTRE_M + 0.5 * const.PAD_LENGTH_M
        _box(finger, (outside, 0.0, 0.5 * (top + tip)), (0.0045, half_width, 0.5 * (tip - top)), "metal")
        pad = (0.5 * const.PAD_THICKNESS_M, 0.5 * width_m, 0.5 * const.PAD_LENGTH_M)
        _box(finger, (side * pad[0], 0.0, const.PAD_CENTRE_M), pad, "rubber")


def _housing(body: mujoco.MjsBody, ends: list[Vec], radius_m: float, *, lid: bool = False, gap: bool = True) -> None:
    """Draw a white drum between two points, behind a dark gap at the first and under a domed lid at the second."""
    start, end = (np.array(point) for point in ends)
    along = (end - start) / np.linalg.norm(end - start)
    if gap:
        _drum(body, tuple(start), tuple(start + _GAP_M * along), 0.94 * radius_m, "joint")
        start = start + _GAP_M * along
    _drum(body, tuple(start), tuple(end), radius_m, "shell")
    if lid:
        _drum(body, tuple(end), tuple(end + 0.006 * along), 0.96 * radius_m, "joint")
        half = _LID_M * np.abs(along) + 0.96 * radius_m * (1.0 - np.abs(along))
        _add(body, _ELLIPSOID, "joint", pos=(end + 0.006 * along).tolist(), size=half.tolist())


def _drum(body: mujoco.MjsBody, start: Vec, end: Vec, radius_m: float, material: str) -> None:
    _add(body, _CYLINDER, material, fromto=[*start, *end], size=[radius_m, 0.0, 0.0])


def _tube(body: mujoco.MjsBody, start: Vec, end: Vec, radius_m: float) -> None:
    """Draw a link as three tubes that taper towards its middle."""
    points = np.linspace(start, end, 4)
    for (a, b), share in zip(pairwise(points), (1.0, 0.93, 1.0), strict=True):
        _add(body, _CAPSULE, "shell", fromto=[*a.tolist(), *b.tolist()], size=[share * radius_m, 0.0, 0.0])


def _box(body: mujoco.MjsBody, pos: Vec, half_size: Vec, material: str) -> None:
    _add(body, _BOX, material, pos=list(pos), size=list(half_size))


def _add(body: mujoco.MjsBody, shape: mujoco.mjtGeom, material: str, **place: list[float]) -> None:
    body.add_geom(type=shape, material=material, mass=0.0, contype=0, conaffinity=0, group=PEOPLE_GROUP, **place)
