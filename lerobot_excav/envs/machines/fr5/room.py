"""The model of the work cell for people: the cell's, with a dressed arm, a table with legs, a floor and shadows."""

from itertools import product

from lerobot_excav.envs.machines.fr5 import layout
from lerobot_excav.envs.machines.fr5.dressing import PEOPLE_GROUP, dress_arm
from lerobot_excav.envs.machines.fr5.mjcf import build_spec
from lerobot_excav.envs.machines.simulator import mujoco

TABLE_TOP = "table_top"
HIDDEN_GROUP = 4

# All by eye. The top covers the area of the blocks, tray and arm with a margin.
_LOW_W, _HIGH_W = (-0.35, 0.05), (0.75, 1.0)
_THICKNESS_M, _HEIGHT_M, _LEG_M = 0.03, 0.74, 0.03
_BAND_RGBA = (0.36, 0.27, 0.19, 1.0)
_LEG_RGBA = (0.30, 0.31, 0.33, 1.0)
_FLOOR_RGBA = (0.50, 0.51, 0.53, 1.0)
_WALL_RGB, _CEILING_RGB = (0.74, 0.77, 0.80), (0.55, 0.60, 0.66)
_HALO_M = 0.002  # half the width of the rods around a block
_SAMPLES, _SHADOW_MAP_PX = 4, 2048


def halo(block: int) -> tuple[str, ...]:
    """Return the names of the rods around a block."""
    return tuple(f"halo{block}_{edge}" for edge in range(12))


def build_room() -> mujoco.MjModel:
    """Compile the model; its joints, cameras, blocks and the tray are those of `mjcf.build_spec`."""
    spec = build_spec()
    quality = spec.visual.quality
    quality.offsamples, quality.shadowsize = _SAMPLES, _SHADOW_MAP_PX
    quality.numslices, quality.numstacks = 32, 12
    spec.visual.map.shadowclip = 0.9
    spec.visual.map.fogstart, spec.visual.map.fogend = 2.5, 9.0
    spec.visual.rgba.fog = [*_WALL_RGB, 1.0]
    spec.stat.center = [0.2, 0.5, 0.1]
    # What lies in a shadow gets the light of the head alone.
    head, lamp = spec.visual.headlight, spec.light("lamp")
    head.active, head.ambient, head.diffuse, head.specular = 1, [0.36, 0.36, 0.38], [0.20] * 3, [0.0] * 3
    lamp.castshadow, lamp.ambient, lamp.specular = True, [0.0] * 3, [0.25] * 3
    _add_surroundings(spec)
    dress_arm(spec)
    for i in range(layout.BLOCK_COUNT):
        _add_halo(spec.body(f"block{i}"), i)
    return spec.compile()


def _add_halo(block: mujoco.MjsBody, number: int) -> None:
    """Add rods along the edges of a block."""
    half = 0.5 * layout.BLOCK_SIZE_M + _HALO_M
    places = [signs for signs in product((-1, 0, 1), repeat=3) if signs.count(0) == 1]
    for name, signs in zip(halo(number), places, strict=True):
        block.add_geom(
            name=name, type=mujoco.mjtGeom.mjGEOM_BOX, pos=[half * sign for sign in signs],
            size=[_HALO_M if sign else half for sign in signs],
            mass=0.0, contype=0, conaffinity=0, group=HIDDEN_GROUP,
        )  # fmt: skip


def _add_surroundings(spec: mujoco.MjSpec) -> None:
    """Put a table with an edge in the place of the endless one, and a room around it."""
    spec.geom("table").group = HIDDEN_GROUP
    sky = spec.add_texture(name="room", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX)
    sky.builtin = mujoco.mjtBuiltin.mjBUILTIN_GRADIENT
    sky.rgb1, sky.rgb2 = _CEILING_RGB, _WALL_RGB
    sky.width, sky.height = 32, 192
    _add_drawn(spec, "floor", mujoco.mjtGeom.mjGEOM_PLANE, [0.0, 0.0, -_HEIGHT_M], [0.0, 0.0, 1.0], _FLOOR_RGBA)
    middle = [0.5 * (low + high) for low, high in zip(_LOW_W, _HIGH_W, strict=True)]
    half = [0.5 * (high - low) for low, high in zip(_LOW_W, _HIGH_W, strict=True)]
    box, thin = mujoco.mjtGeom.mjGEOM_BOX, 0.004
    _add_drawn(spec, TABLE_TOP, box, [*middle, -0.5 * thin], [*half, 0.5 * thin], _FLOOR_RGBA)
    under = 0.5 * (_THICKNESS_M - thin)
    _add_drawn(spec, "table_band", box, [*middle, -thin - under], [half[0] + 0.002, half[1] + 0.002, under], _BAND_RGBA)
    for x in (_LOW_W[0] + 0.06, _HIGH_W[0] - 0.06):
        for y in (_LOW_W[1] + 0.06, _HIGH_W[1] - 0.06):
            leg = 0.5 * (_HEIGHT_M - _THICKNESS_M)
            _add_drawn(spec, "", box, [x, y, -_THICKNESS_M - leg], [_LEG_M, _LEG_M, leg], _LEG_RGBA)


def _add_drawn(
    spec: mujoco.MjSpec,
    name: str,
    shape: mujoco.mjtGeom,
    pos: list[float],
    size: list[float],
    rgba: tuple[float, float, float, float],
) -> None:
    spec.worldbody.add_geom(
        name=name, type=shape, pos=pos, size=size, rgba=rgba, contype=0, conaffinity=0, group=PEOPLE_GROUP
    )
