"""How much of the soil a camera sees: what a dig region would fill of its picture, without drawing one."""

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.pinhole import CameraPose
from lerobot_excav.envs.soil.compiled import kernel


def seen_area_px(
    heights_m: NDArray[np.float64],
    x_w: NDArray[np.float64],
    y_w: NDArray[np.float64],
    pose: CameraPose,
    *,
    picture_height_px: int,
) -> NDArray[np.float64]:
    """Return the area that every cell of a height field fills in a picture; what stands on the soil is ignored.

    A surface element of vector area A at v before the eye covers f² (A · v) / d³ of a picture of focal length f, where
    d is the depth of the element along the optical axis (perspective projection).

    The soil is that of `feasible_centers_w`, the camera fixed to the world, its picture so many pixels high. The areas
    (nx, ny) [px] are zero for cells that face away, or that other soil hides. The borders of the picture are not
    regarded.
    """
    cell_size_m = float(x_w[1] - x_w[0])
    eye_w = np.asarray(pose.position)
    slope_x, slope_y = np.gradient(heights_m, cell_size_m)
    to_eye = eye_w - np.stack(np.broadcast_arrays(x_w[:, None], y_w[None, :], heights_m), axis=-1)
    area_vector = cell_size_m**2 * np.stack([-slope_x, -slope_y, np.ones_like(heights_m)], axis=-1)
    depth_m = to_eye @ pose.axes[:, 2]
    focal_px = 0.5 * picture_height_px / np.tan(0.5 * np.radians(pose.fovy_deg))
    facing = np.maximum(0.0, np.sum(area_vector * to_eye, axis=-1))
    hidden = hidden_cells(heights_m, float(x_w[0]), float(y_w[0]), cell_size_m, eye_w)
    return np.asarray(np.where(hidden, 0.0, focal_px**2 * facing / depth_m**3))


@kernel
def hidden_cells(
    heights_m: NDArray[np.float64], x0_w: float, y0_w: float, cell_size_m: float, eye_w: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Tell which cells (nx, ny) of a field other soil hides from an eye (3,) [m], which is higher than all soil.

    The surface is bilinear between cell centres, the first of which is at `x0_w`, `y0_w`; lines of sight are followed
    in steps of half a cell.
    """
    nx, ny = heights_m.shape
    highest = heights_m.max()
    hidden = np.zeros((nx, ny), dtype=np.bool_)
    for ix in range(nx):
        for iy in range(ny):
            # One step of half a cell on the ground plane, in cells and in metres of height.
            dx = (eye_w[0] - x0_w) / cell_size_m - ix
            dy = (eye_w[1] - y0_w) / cell_size_m - iy
            steps = 2.0 * np.hypot(dx, dy)
            if steps < 1.0:
                continue
            dx, dy, rise = dx / steps, dy / steps, (eye_w[2] - heights_m[ix, iy]) / steps
            # The cell's own facet reaches one cell far; it is seen or not by its slope.
            step = 2
            while True:
                x, y, z = ix + step * dx, iy + step * dy, heights_m[ix, iy] + step * rise
                if step > steps or z > highest or not (0.0 <= x < nx - 1 and 0.0 <= y < ny - 1):
                    break
                i, j = int(x), int(y)
                u, v = x - i, y - j
                low = heights_m[i, j] * (1.0 - u) + heights_m[i + 1, j] * u
                high = heights_m[i, j + 1] * (1.0 - u) + heights_m[i + 1, j + 1] * u
                if low * (1.0 - v) + high * v > z:
                    hidden[ix, iy] = True
                    break
                step += 1
    return hidden
