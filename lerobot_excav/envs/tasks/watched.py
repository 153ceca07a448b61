"""What a person sees of an episode: `render()`, hence LeRobot's videos of evaluations."""

from abc import ABC, abstractmethod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.machines.view import View
from lerobot_excav.envs.masks.source import TargetMask
from lerobot_excav.envs.tasks.caption import Caption, captioned
from lerobot_excav.envs.tasks.film import Film
from lerobot_excav.envs.tasks.relief import Relief
from lerobot_excav.envs.tasks.settings import RenderSettings, TaskSettings


class WatchedEnv(ABC):
    """An environment whose episodes people watch, with other pictures than its policies see.

    Nothing of them is made before the first `render()`.
    """

    render_mode: str | None
    render_settings: RenderSettings
    settings: TaskSettings

    _is_over = False
    _view: View | None = None
    _film_view: View | None = None
    _film: Film | None = None
    _picture: NDArray[np.uint8] | None = None
    _drawn = (False, 0)  # whether the episode was over when the picture was drawn, and its frame

    @abstractmethod
    def _make_view(self, height: int, width: int) -> View:
        """Make what draws the world for people."""

    def _visible_target(self, target_id: int) -> Any:
        """Return a target of the scene as the view knows it."""
        return target_id

    def _measured(self) -> tuple[str, ...]:
        """Return what a caption says of the episode now, the most telling first."""
        return ()

    def _failure(self) -> str | None:
        """Return why the task has failed, in two or three words, or None if it is not decided yet."""
        return "failed" if self.is_over and not self.is_success else None

    @property
    def is_over(self) -> bool:
        """Whether the episode has ended."""
        return self._is_over

    @property
    @abstractmethod
    def target_id(self) -> int:
        """Index of the target that is commanded now."""

    @property
    @abstractmethod
    def mask(self) -> TargetMask | None:
        """The mask of the command, as shown."""

    @property
    @abstractmethod
    def is_success(self) -> bool:
        """Whether the task has succeeded by now."""

    @property
    @abstractmethod
    def time_s(self) -> float:
        """Simulated time since the start of the episode [s]."""

    def render(self) -> NDArray[np.uint8] | None:
        """Return a picture for people (`render_height`, `render_width`, 3) uint8, or None without a render mode.

        The commanded target is marked, and another target that the mask shows; a caption tells how the task stands.
        With `render_every` above 1 the last picture is shown again until its time is over; the end is always drawn.

        Raises:
            ConfigurationError: The environment has not been reset.
            RenderingError: Pictures cannot be made on this machine.
        """
        if self.render_mode is None:
            return None
        every, drawn = self.render_settings.render_every, (self._is_over, round(self.time_s * self.settings.fps))
        is_end = self._is_over and drawn != self._drawn
        if self._picture is None or is_end or every == 1 or drawn[1] - self._drawn[1] >= every:
            if self._view is None:
                self._view = self._make_view(self.render_settings.render_height, self.render_settings.render_width)
            self._picture, self._drawn = self._draw_for_people(self._view), drawn
        return self._picture.copy()

    def _draw_for_people(self, view: View) -> NDArray[np.uint8]:
        other = self._other_target_shown()
        view.mark(self._visible_target(self.target_id), shown=None if other is None else self._visible_target(other))
        return captioned(view.render(self.render_settings.render_camera), self.caption)

    def _begin_film(self, name: str) -> None:
        """Begin the film of an episode, if films are wanted.

        Raises:
            OSError: It cannot be written.
        """
        if (folder := self.render_settings.film_folder) is None:
            return
        self._film = self._film or Film(Path(folder), self.settings.fps)
        self._film.begin(name)
        self._add_to_film()

    def _add_to_film(self) -> None:
        """Add the present picture to the film if its turn has come; the end of the episode is its end."""
        settings, frame = self.render_settings, round(self.time_s * self.settings.fps)
        is_due = frame % settings.film_every == 0 or self._is_over
        if self._film is None or not self._film.is_running or not is_due:
            return
        if self._film_view is None:
            self._film_view = self._make_view(settings.film_height, settings.film_width)
        self._film.add(self._draw_for_people(self._film_view))
        if self._is_over:
            self._film.end()

    def _other_target_shown(self) -> int | None:
        """Return the target that the mask shows, unless it is the commanded one or none that the source could name."""
        shown = None if self.mask is None else self.mask.target_id
        return None if shown == self.target_id else shown

    @property
    def caption(self) -> Caption:
        """What a picture says of the episode now."""
        words = (*self._measured(), f"{self.time_s:.1f} s", *self.settings.mask_faults)
        if self.is_over and self.is_success:
            return Caption(words=words, outcome="success", is_success=True)
        return Caption(words=words, outcome=self._failure(), is_success=False)

    def plan_view(self) -> NDArray[np.uint8] | None:
        """Return a map of the scene from above, (H, W, 3) uint8, which costs little; None if the task draws none."""
        return None

    def relief(self) -> Relief | None:
        """Return the surface of the ground now; None if the task has none that changes."""
        return None

    def _close_views(self) -> None:
        """Free the graphics contexts of the views; the film of an episode that has not come to its end is left out."""
        if self._film is not None:
            self._film.leave_out()
        for view in (self._view, self._film_view):
            if view is not None:
                view.close()
        self._view = self._film_view = self._picture = None
