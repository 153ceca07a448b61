"""Pictures of single parcels: each is a handful of small tetrahedra, and hundreds of parcels share one skin.

A software renderer spends its time per geom, hardly per triangle: with llvmpipe a thousand spheres cost 30 ms a view,
and skins of a thousand parcels 2 ms.
"""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.excavator.bodywork import HIDDEN_GROUP, LOOSE_SOIL_GROUP
from lerobot_excav.envs.machines.simulator import mujoco

PARCELS_PER_SKIN = 250
MOST_PARCELS = 4000
"""More than the finest soil has in the bucket and in motion together."""

_SKINS = MOST_PARCELS // PARCELS_PER_SKIN
_GRAINS = 6
"""Tetrahedra that stand for one parcel."""

# In radii of the parcel; its bulk volume reaches 1.2 radii (kind: tuned by eye).
_SCATTER = 1.2
_SMALLEST, _LARGEST = 0.36, 0.84

_TEXTURE_SPOT = 0.02
_LOOK_SEED = 11  # a picture, not an experiment: the same grains in every scene

# A tetrahedron in the unit sphere, its faces counter-clockwise from outside.
_CORNERS = np.array([(1, 1, 1), (-1, -1, 1), (-1, 1, -1), (1, -1, -1)]) / np.sqrt(3.0)
_FACES = np.array([(0, 1, 3), (0, 2, 1), (0, 3, 2), (1, 2, 3)])
_VERTICES = _GRAINS * len(_CORNERS)


def add_grains(spec: mujoco.MjSpec) -> None:
    """Add the skins of the grains; none of them is seen before `Grains.show`."""
    rng = np.random.default_rng(_LOOK_SEED)
    grains = PARCELS_PER_SKIN * _GRAINS
    vertices = PARCELS_PER_SKIN * _VERTICES
    faces = _FACES + len(_CORNERS) * np.arange(grains)[:, None, None]
    for number in range(_SKINS):
        skin = spec.add_skin(name=_name(number), material="grains", group=HIDDEN_GROUP)
        skin.vert = [0.0] * (3 * vertices)
        # Every grain shows a spot of the texture, and so has a shade of its own.
        spots = rng.uniform(size=(grains, 1, 2)) + _TEXTURE_SPOT * _CORNERS[:, :2]
        skin.texcoord = spots.ravel().tolist()
        skin.face = faces.ravel().tolist()
        skin.bodyname = ["world"]
        skin.bindpos, skin.bindquat = [0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]
        skin.vertid, skin.vertweight = [list(range(vertices))], [[1.0] * vertices]


class Grains:
    """Shows parcels in the skins that `add_grains` has added to a model."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._skins = [model.skin(_name(number)).id for number in range(_SKINS)]
        first = model.skin_vertadr[self._skins[0]]
        # The skins were added one after the other, so that their vertices lie in one block.
        block = model.skin_vert[first : first + MOST_PARCELS * _VERTICES]
        self._vertices = block.reshape(MOST_PARCELS, _VERTICES, 3)
        self._shapes = _draw_shapes(np.random.default_rng(_LOOK_SEED)).astype(np.float32)

    def show(
        self,
        positions_w: NDArray[np.float64],
        radii_m: NDArray[np.float64],
        shapes: NDArray[np.intp] | None = None,
    ) -> None:
        """Show parcels with these centres (n, 3) and radii (n,) [m], the first `MOST_PARCELS`, and no others.

        Numbers (n,) say which shape each has; by default its own place in the row.
        """
        count = min(len(positions_w), MOST_PARCELS)
        skins = -(-count // PARCELS_PER_SKIN)
        centres = positions_w[:count].astype(np.float32)
        radii = radii_m[:count].astype(np.float32)
        own = self._shapes[:count] if shapes is None else self._shapes[shapes[:count] % MOST_PARCELS]
        self._vertices[:count] = centres[:, None] + radii[:, None, None] * own
        if count:  # the rest of the last skin shrinks into a point
            self._vertices[count : skins * PARCELS_PER_SKIN] = centres[-1]
        for number, skin in enumerate(self._skins):
            self._model.skin_group[skin] = LOOSE_SOIL_GROUP if number < skins else HIDDEN_GROUP


def _name(number: int) -> str:
    return f"grains_{number}"


def _draw_shapes(rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw the vertices of every parcel's grains around its centre, (parcels, vertices, 3) in radii."""
    count = MOST_PARCELS * _GRAINS
    turned = _CORNERS @ _draw_rotations(rng, count)
    sizes = rng.uniform(_SMALLEST, _LARGEST, (count, 1, 1))
    away = rng.standard_normal((count, 1, 3))
    away *= _SCATTER * np.cbrt(rng.uniform(size=(count, 1, 1))) / np.linalg.norm(away, axis=-1, keepdims=True)
    return np.asarray((sizes * turned + away).reshape(MOST_PARCELS, _VERTICES, 3))


def _draw_rotations(rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    """Draw rotation matrices (n, 3, 3)."""
    axes, _ = np.linalg.qr(rng.standard_normal((count, 3, 3)))
    return np.asarray(axes * np.linalg.det(axes)[:, None, None])
