"""Twin of `parcels.load`: which parcels a bucket carries."""

import numpy as np

from lerobot_excav.envs.soil.arrays import Array
from lerobot_excav.envs.soil.parcels.load import LARGEST_HEAP_M, LEAVING_M_S, LOOKS_UP
from lerobot_excav.envs.soil.parcels.plates import ToolPath


def is_load(tool: ToolPath, position: Array, velocity: Array, radius: float) -> bool:
    """Tell whether a parcel lies in the bucket, or slowly enough in the heap above an opening that looks up.

    The heap reaches one radius over the rim: a parcel can lie on edge, lip and side plates.
    """
    rotation, origin = tool.rotations[-1], tool.positions[-1]
    point_t = (position - origin) @ rotation
    beyond = tool.planes[:, :3] @ point_t - tool.planes[:, 3]
    if beyond[0] <= 0.0:
        return bool(beyond[1:].max() < 0.0)
    opening_up = float((rotation @ tool.planes[0, :3])[2])
    edge, lip = tool.profile[0], tool.profile[-1]
    length = float(np.linalg.norm(lip - edge))
    along = (point_t[[0, 2]] - edge) @ (lip - edge) / length
    relative = velocity - tool.linear - np.cross(tool.angular, position - origin)
    return bool(
        opening_up > LOOKS_UP
        and beyond[0] < LARGEST_HEAP_M
        and -radius < along < length + radius
        and abs(point_t[1]) < tool.half_width + radius
        and np.linalg.norm(relative) < LEAVING_M_S
    )
