"""What Rerun shows of a simulated robot with `--display_data=true`, beside LeRobot's own pictures and curves.

LeRobot logs what a robot returns: states and pictures. The target in the picture, the state of the task and the soil
are no observations, so the robot logs them itself, into the recording that LeRobot has opened. Without one nothing is
imported and nothing is drawn.
"""

import sys
from collections.abc import Iterable
from typing import Any

from lerobot_excav.envs.masks.overlay import tinted
from lerobot_excav.envs.tasks.masked_env import MaskedTaskEnv

TARGET = "excav/main_with_target"
"""Path of the main view with the mask tinted."""

GROUND = "excav/ground"
"""Path of the soil's surface."""

TASK_STATE = "excav/task_state"
"""Path above the elements of the task state."""

GROUND_EVERY_S = 0.5
"""Simulated time from one surface to the next [s]; one is 1 MB (kind: guess: it changes slowly)."""


class RerunLog:
    """Logs an environment into the open recording of Rerun, if there is one.

    Args:
        env: What is shown.
        names: Names of the robot's states and commands, as LeRobot logs them: `observation.swing.pos`, …
    """

    def __init__(self, env: MaskedTaskEnv[Any, Any], names: Iterable[str]) -> None:
        self._env, self._names = env, list(names)
        self._count = 0

    def show(self, observation: dict[str, Any]) -> None:
        """Log the present moment; `observation` is the environment's."""
        rerun = open_recording()
        if rerun is None:
            return
        pixels, mask = observation["pixels"], self._env.mask
        # LeRobot logs pictures as static, too: Rerun keeps the last one only, or hours of them would fill the memory.
        main = pixels["main"] if mask is None else tinted(pixels["main"], mask.pixels)
        rerun.log(TARGET, rerun.Image(main), static=True)
        for name, value in zip(self._env.task_spec.task_state_names, self._env.task_state, strict=True):
            rerun.log(f"{TASK_STATE}/{name}", rerun.Scalars(float(value)))
        if self._count % max(1, round(GROUND_EVERY_S * self._env.fps)) == 0:
            self._show_ground(rerun)
        if self._count == 1:  # LeRobot has sent its own layout, without any of this, after the first frame
            rerun.send_blueprint(self._layout(observation))
        self._count += 1

    def _show_ground(self, rerun: Any) -> None:
        relief = self._env.relief()
        if relief is None:
            return
        mesh = rerun.Mesh3D(
            vertex_positions=relief.vertices_w,
            triangle_indices=relief.triangles,
            vertex_colors=relief.rgb.reshape(-1, 3),
        )
        rerun.log(GROUND, mesh, static=True)

    def _layout(self, observation: dict[str, Any]) -> Any:
        """Return the layout: the target and the ground large, then the cameras, then the curves."""
        import rerun.blueprint as rrb

        large: list[Any] = [rrb.Spatial2DView(origin=TARGET, name="main, the target tinted")]
        if self._env.relief() is not None:
            large.append(rrb.Spatial3DView(origin=GROUND, name="ground"))
        cameras = [rrb.Spatial2DView(origin=f"observation.{camera}", name=camera) for camera in observation["pixels"]]
        curves = [
            rrb.TimeSeriesView(origin=TASK_STATE, name="task state"),
            rrb.TimeSeriesView(name="observation", contents=[f"observation.{name}" for name in self._names]),
            rrb.TimeSeriesView(name="action", contents=[f"action.{name}" for name in self._names]),
        ]
        rows = [rrb.Horizontal(*large), rrb.Horizontal(*cameras), rrb.Horizontal(*curves)]
        return rrb.Blueprint(rrb.Vertical(*rows, row_shares=[3, 2, 2]))


def open_recording() -> Any | None:
    """Return the module `rerun` if a recording is open in this process, else None."""
    rerun = sys.modules.get("rerun")
    return rerun if rerun is not None and rerun.get_data_recording() is not None else None
