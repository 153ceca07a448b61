"""The model of the worksite for people: the machine's, with a horizon, shadows, finer soil and a plumb line."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator import surfaces
from lerobot_excav.envs.machines.excavator.bodywork import MACHINE_GROUP, UNTOUCHED
from lerobot_excav.envs.machines.excavator.layout import DIG_AREA_EXTENT_M
from lerobot_excav.envs.machines.excavator.mjcf import build_spec
from lerobot_excav.envs.machines.excavator.soil_paint import TEXELS
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.envs.soil.container import Container

TERRAIN_SPACING_M = 0.05
SOIL_TEXTURE = "soil_paint"
CLEAR_WALL = "clear_wall"
PLUMB_LINE = ("plumb_line", "plumb_foot")

# All tuned by eye.
_HORIZON_RGB = (0.80, 0.85, 0.90)
_ZENITH_RGB = (0.33, 0.55, 0.83)
_CLEAR_ALPHA = 0.3
_SAMPLES, _SHADOW_MAP_PX = 4, 2048  # twice as fine a map takes twice the time, drawn by software, and looks the same
_PLUMB_RADIUS_M, _FOOT_RADIUS_M = 0.014, 0.09
_PLUMB_RGBA = (0.95, 0.98, 1.0, 1.0)
_ANYWHERE = [0.0, 0.0, 1.0]  # not where its body is, or MuJoCo would never look at its place again
_SHADE_LIGHT = 0.42
_GROUND_TILE_M = 5.0
_SUNK_M = 0.007  # the dig area is drawn so much too low that bare ground covers it, and no border shows
_GROUND_PIXELS = 256


def build_scenery(container: Container) -> mujoco.MjModel:
    """Compile the model; its joints, cameras, materials and skins are those of `mjcf.build_spec`."""
    spec = build_spec(container, terrain_spacing_m=TERRAIN_SPACING_M)
    quality = spec.visual.quality
    quality.offsamples, quality.shadowsize = _SAMPLES, _SHADOW_MAP_PX
    quality.numslices, quality.numstacks = 32, 12
    _light(spec)
    _spread_ground(spec)
    _paint_terrain(spec)
    _open_box(spec)
    horn = spec.body("arm").first_geom()
    horn.size[1] -= 0.003  # its sides would flicker through those of the beam
    _add_plumb_line(spec)
    return spec.compile()


def _light(spec: mujoco.MjSpec) -> None:
    """Let the sun cast shadows, open the sky, and let the ground fade into it."""
    spec.light("sun").castshadow = True
    spec.visual.map.shadowclip = 4.0  # wide: near the border of its map the ground shadows itself in specks
    spec.visual.map.zfar = 30.0
    spec.visual.map.fogstart, spec.visual.map.fogend = 4.0, 26.0
    spec.visual.rgba.fog = [*_HORIZON_RGB, 1.0]
    spec.visual.headlight.ambient = [_SHADE_LIGHT * c for c in (0.95, 1.0, 1.08)]
    sky = spec.texture("sky")
    sky.rgb1, sky.rgb2 = _ZENITH_RGB, _HORIZON_RGB


def _spread_ground(spec: mujoco.MjSpec) -> None:
    """Spread the drawn ground to the horizon; its texture is fine gravel in the colour of the scene."""
    ground = spec.geom("ground_picture")
    ground.pos, ground.size = [0.0, 0.0, -0.001], [0.0, 0.0, 1.0]
    texture = spec.add_texture(name="gravel", type=mujoco.mjtTexture.mjTEXTURE_2D, nchannel=3)
    texture.width = texture.height = _GROUND_PIXELS
    texture.data = surfaces.grain_texture(_GROUND_PIXELS)
    material = spec.material("ground")
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "gravel"
    material.texuniform, material.texrepeat = True, [1.0 / _GROUND_TILE_M] * 2


def _paint_terrain(spec: mujoco.MjSpec) -> None:
    """Give the dig area a texture of its own, each texel at its place."""
    texture = spec.add_texture(name=SOIL_TEXTURE, type=mujoco.mjtTexture.mjTEXTURE_2D, nchannel=3)
    texture.width = texture.height = TEXELS
    texture.data = bytes(3 * TEXELS**2)
    material = spec.add_material(name=SOIL_TEXTURE, specular=0.0, shininess=0.0, reflectance=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = SOIL_TEXTURE
    skin = spec.skin(surfaces.TERRAIN_SKIN)
    skin.material = SOIL_TEXTURE
    skin.bindpos = [0.0, 0.0, _SUNK_M]
    places: NDArray[np.float32] = np.reshape(skin.vert, (-1, 3))[:, :2]
    skin.texcoord = (places / np.array(DIG_AREA_EXTENT_M) + 0.5).ravel().tolist()


def _open_box(spec: mujoco.MjSpec) -> None:
    """Let the soil in the box be seen through the walls on the side of the cameras."""
    solid = spec.material("box")
    spec.add_material(name=CLEAR_WALL, rgba=[*solid.rgba[:3], _CLEAR_ALPHA], specular=solid.specular)
    for wall in ("box_wall_front", "box_wall_right"):
        spec.geom(wall).material = CLEAR_WALL


def _add_plumb_line(spec: mujoco.MjSpec) -> None:
    for name, shape, size in zip(
        PLUMB_LINE,
        (mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_SPHERE),
        ([_PLUMB_RADIUS_M, 1.0, 0.0], [_FOOT_RADIUS_M, 0.0, 0.0]),
        strict=True,
    ):
        spec.worldbody.add_geom(
            name=name,
            type=shape,
            pos=_ANYWHERE,
            size=size,
            rgba=_PLUMB_RGBA,
            mass=0.0,
            group=MACHINE_GROUP,
            **UNTOUCHED,
        )
