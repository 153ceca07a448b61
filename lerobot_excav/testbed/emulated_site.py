"""Where the emulated machine works: one start after the other, each until its cycle is over."""

from collections.abc import Callable
from threading import Thread
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.pinhole import PinholeCamera
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.source import TargetMask, make_mask_source
from lerobot_excav.envs.tasks.registry import task_of_settings
from lerobot_excav.envs.tasks.scoop.scene import draw_scene
from lerobot_excav.envs.tasks.scoop.settings import ExcavatorSettings
from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.envs.tasks.shown_source import shown_source
from lerobot_excav.testbed.emulator import EmulatedMachine, Emulator
from lerobot_excav.testbed.picture_stream import FARTHEST_M, depth_name
from lerobot_excav.testbed.protocol import RATE_HZ

MASK = "target_mask"


class EmulatedSite:
    """Shows the targets of scene after scene to an emulated machine.

    When a cycle is over, or its time is, the next target is shown, as if somebody had heaped the pile up again.

    Args:
        settings: Those of the task; its frame rate is that of the protocol.
        machine: The machine.
        first_scene: Number of the first scene.
        host: Address to listen at.
        ports: Of datagrams and pictures; 0 takes a free one.
        has_depth: Whether it has the depth of its camera `main` as well.
        on_over: Told the metrics of every cycle.

    Attributes:
        emulator: The machine, ready to run.
    """

    def __init__(
        self,
        settings: TaskSettings,
        machine: EmulatedMachine,
        *,
        first_scene: int = 0,
        host: str = "127.0.0.1",
        ports: tuple[int, int] = (0, 0),
        has_depth: bool = False,
        on_over: Callable[[dict[str, Any]], None] = lambda metrics: None,
    ) -> None:
        settings.require_commanded_mask()
        self._settings = settings
        self._spec = task_of_settings(settings)
        # Without pictures of its own: at 50 Hz nobody could draw them all.
        self._env = self._spec.make_env(
            obs_type="agent_pos", render_mode=None, **{**settings.as_dict(), "fps": RATE_HZ}
        )
        self._source = shown_source(make_mask_source(settings.mask_source, options=settings.mask_options), settings)
        self._masked: Command | None = None
        self._mask: TargetMask | None = None
        self._black: NDArray[np.uint8] = np.zeros((*settings.observation_size, 3), np.uint8)
        self._has_depth = has_depth
        self._start, self._tell = first_scene * self._spec.starts_per_scene, on_over
        self._show()
        self.emulator = Emulator(
            self._env,
            machine,
            host=host,
            port=ports[0],
            picture_port=ports[1],
            pictures=self.pictures,
            on_over=self._go_on,
        )

    @property
    def camera(self) -> PinholeCamera:
        """Where its camera `main` stands, and how it projects."""
        camera: PinholeCamera = self._env.camera
        return camera

    def pictures(self) -> dict[str, NDArray[np.uint8] | NDArray[np.uint16]]:
        """Return what the cameras show now, by name; the mask is made once for a command, black if nothing is found."""
        shown = {name: self._env.renderer.render(name) for name in self._spec.cameras if name not in ("main", MASK)}
        self._look()
        depth = {depth_name("main"): self._depth_mm()} if self._has_depth else {}
        return {"main": self._env.picture(), **shown, **depth, MASK: self._mask_img()}

    def _depth_mm(self) -> NDArray[np.uint16]:
        """Return the depth of `main`, (H, W) [mm]; as of a depth camera, 0 for what is too far away."""
        depth_mm = np.rint(1e3 * self._env.depth_m())
        return np.where(depth_mm <= 1e3 * FARTHEST_M, depth_mm, 0.0).astype(np.uint16)

    def _look(self) -> None:
        """Make the mask of a new command."""
        if self._env.command is self._masked:
            return
        self._masked = self._env.command
        self._mask = self._source.mask(self._env, self._masked)

    def _mask_img(self) -> NDArray[np.uint8]:
        """Return the mask as it is shown now, black if nothing was found."""
        if self._mask is None:
            return self._black
        return self._source.at_frame(self._mask, self._env, self._env.command, self._env.frame).img

    def close(self) -> None:
        """Switch the machine off, and free the graphics context."""
        self.emulator.close()
        self._env.close()

    def _go_on(self, metrics: dict[str, Any]) -> None:
        self._tell(metrics)
        self._start += 1
        self._show()

    def _show(self) -> None:
        scene_id, target_id = divmod(self._start, self._spec.starts_per_scene)
        self._env.reset(options={"scene_id": scene_id, "target_id": target_id})
        self._look()
        self._draw_ahead(scene_id + 1)

    def _draw_ahead(self, scene_id: int) -> None:
        """Draw a later scene meanwhile, which is kept: that can take longer than a robot waits for a picture."""
        settings = self._settings
        if isinstance(settings, ExcavatorSettings):
            options = {"soil": settings.soil, "pile": settings.pile}
            Thread(target=draw_scene, args=(settings.scene_set, scene_id), kwargs=options, daemon=True).start()
