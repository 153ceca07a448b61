"""Deformable pictures of the soil: skins whose vertices follow the soil's height field.

A MuJoCo height field has to be uploaded whole as a display list when it changes, which takes tens of
milliseconds on a CPU. The vertices of a skin are streamed to the renderer with every picture anyway, so moving
them costs nothing extra; normals are recomputed, so that slopes show.
"""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.bodywork import SURROUNDINGS_GROUP
from lerobot_excav.envs.machines.excavator.layout import DIG_AREA_EXTENT_M
from lerobot_excav.envs.machines.simulator import mujoco
from lerobot_excav.envs.soil.container import Container

TERRAIN_SKIN = "terrain"
BOX_SOIL_SKIN = "box_soil"
POLICY_SPACING_M = 0.1
"""Between the vertices of the terrain in pictures for policies [m]: finer is slower, and a pixel is as wide."""
_BOX_SPACING_M = 0.05
_SKIRT_DEPTH_M = 0.05
_GRAIN_GLOW = 0.25  # tuned by eye
_TEXTURE_PIXELS = 128
_TEXTURE_PERIOD_M = 2.0
_TEXTURE_SEED = 7  # a picture, not an experiment: the same grain in every scene


def add_soil(spec: mujoco.MjSpec, container: Container, *, spacing_m: float) -> None:
    """Add the skins of the dig area and of the soil in the target box, the latter in the frame of the box."""
    _add_soil_materials(spec)
    add_sheet(spec, TERRAIN_SKIN, "world", terrain_grid(spacing_m), SURROUNDINGS_GROUP)
    add_sheet(spec, BOX_SOIL_SKIN, "box", box_grid(container), SURROUNDINGS_GROUP)


def terrain_grid(spacing_m: float) -> NDArray[np.float64]:
    """Return the vertices of the terrain picture on the ground plane, shape (nx, ny, 2) [m]."""
    return _grid(DIG_AREA_EXTENT_M, spacing_m)


def box_grid(container: Container) -> NDArray[np.float64]:
    """Return the vertices of the picture of the soil in the box, box frame, shape (nx, ny, 2) [m]."""
    half_x, half_y = container.half_extent_m
    return _grid((2 * half_x, 2 * half_y), _BOX_SPACING_M)


def skin_vertices(
    grid: NDArray[np.float64], heights_m: NDArray[np.float64], foot_m: float | NDArray[np.float64] = -_SKIRT_DEPTH_M
) -> NDArray[np.float32]:
    """Return the vertices (nx ny + border, 3) of a soil skin: the surface, then a skirt that closes its border below.

    Ground-plane points are (nx, ny, 2), heights (nx, ny), and the height of the skirt's foot one or (nx, ny) [m].
    """
    top = np.concatenate([grid, heights_m[..., None]], axis=-1).reshape(-1, 3)
    border = _border(heights_m.shape)
    skirt = top[border]
    skirt[:, 2] = np.broadcast_to(foot_m, heights_m.shape).ravel()[border]
    return np.concatenate([top, skirt], dtype=np.float32)


def write_skin(model: mujoco.MjModel, name: str, vertices: NDArray[np.float32]) -> None:
    """Move the vertices of a skin of a model."""
    start = model.skin_vertadr[model.skin(name).id]
    model.skin_vert[start : start + len(vertices)] = vertices


def _grid(shape_m: tuple[float, float], spacing_m: float) -> NDArray[np.float64]:
    counts = [max(2, round(size / spacing_m) + 1) for size in shape_m]
    x, y = (np.linspace(-size / 2, size / 2, n) for size, n in zip(shape_m, counts, strict=True))
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)


def _border(shape: tuple[int, ...]) -> NDArray[np.intp]:
    """Return the indices of a grid's border vertices, once around, counter-clockwise."""
    index = np.arange(shape[0] * shape[1]).reshape(shape)
    return np.concatenate([index[:-1, 0], index[-1, :-1], index[:0:-1, -1], index[0, :0:-1]])


def _faces(shape: tuple[int, ...]) -> NDArray[np.int32]:
    """Return the triangles of surface and skirt, counter-clockwise from outside."""
    index = np.arange(shape[0] * shape[1]).reshape(shape)
    a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
    top = np.concatenate([np.stack([a, b, c], -1).reshape(-1, 3), np.stack([a, c, d], -1).reshape(-1, 3)])
    rim = _border(shape)
    foot = index.size + np.arange(rim.size)
    rim_next, foot_next = np.roll(rim, -1), np.roll(foot, -1)
    skirt = np.concatenate([np.stack([foot, foot_next, rim_next], -1), np.stack([foot, rim_next, rim], -1)])
    return np.concatenate([top, skirt], dtype=np.int32)


def add_sheet(spec: mujoco.MjSpec, name: str, body: str, grid: NDArray[np.float64], group: int) -> None:
    """Add a skin of the soil's material: a level sheet with its skirt, which moves with a body.

    Its vertices (nx, ny, 2) [m] are in the frame of the body, counter-clockwise where they are seen from.
    """
    shape = grid.shape[:2]
    vertices = skin_vertices(grid, np.zeros(shape))
    skin = spec.add_skin(name=name, material="soil", group=group)
    skin.vert = vertices.ravel().tolist()
    skin.texcoord = (vertices[:, :2] / _TEXTURE_PERIOD_M).ravel().tolist()
    skin.face = _faces(shape).ravel().tolist()
    skin.bodyname = [body]
    skin.bindpos, skin.bindquat = [0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]
    skin.vertid, skin.vertweight = [list(range(len(vertices)))], [[1.0] * len(vertices)]


def _add_soil_materials(spec: mujoco.MjSpec) -> None:
    """Add the materials of the soil and of its single grains: a tileable grain that the colour of the scene multiplies.

    Most faces of a grain turn away from the sun; without a glow of their own, falling soil would be darker than a heap.
    """
    texture = spec.add_texture(name="grain", type=mujoco.mjtTexture.mjTEXTURE_2D, nchannel=3)
    texture.width = texture.height = _TEXTURE_PIXELS
    texture.data = grain_texture(_TEXTURE_PIXELS)
    for name, glow in (("soil", 0.0), ("grains", _GRAIN_GLOW)):
        material = spec.add_material(name=name, specular=0.0, shininess=0.0, reflectance=0.0, emission=glow)
        material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "grain"


def grain_texture(pixels: int) -> bytes:
    """Return a tileable grain (pixels, pixels, 3) in shades of grey, which the colour of a material multiplies."""
    rng = np.random.default_rng(_TEXTURE_SEED)
    noise = rng.standard_normal((pixels, pixels))
    frequency = np.hypot(*np.meshgrid(*[np.fft.fftfreq(pixels)] * 2))
    grain = np.fft.ifft2(np.fft.fft2(noise) / (1.0 + (12.0 * frequency) ** 2) ** 0.5).real
    brightness = np.clip(225.0 + 22.0 * grain / grain.std(), 120.0, 255.0).astype(np.uint8)
    return np.repeat(brightness[..., None], 3, axis=2).tobytes()
