"""Many worlds in one process: a vector environment whose worlds step at the same time, in threads.

Soil kernels and MuJoCo let other threads run while they work, so that worlds share the cores of a machine without the
processes, pipes and copies of `AsyncVectorEnv`. What a world does depends on its own seed and actions alone.
"""

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import partial
from pkgutil import resolve_name
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.vector.utils import iterate
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.registry import task_spec
from lerobot_excav.errors import require_choice, require_integer

AUTORESET_MODES = tuple(mode.value for mode in AutoresetMode)


class ManyWorlds(SyncVectorEnv[Any, Any]):
    """Worlds of one task; what `gym.make_vec("lerobot_excav/…", num_envs=n)` makes.

    Everything that is seen and returned is as with Gymnasium's `SyncVectorEnv` of the same environments, bit by bit.

    Args:
        num_envs: How many worlds.
        task: Id of the task.
        threads: How many of them step at the same time; left out: one per core that this process may use.
        autoreset_mode: When a world that has ended begins its next episode, by Gymnasium's names: `NextStep`,
            `SameStep` (these resets pass one after another) or `Disabled`.
        settings: What each environment is made with: `obs_type`, `soil`, ...

    Raises:
        ConfigurationError: A number is below 1, or a setting is unknown or not possible.
    """

    def __init__(
        self,
        num_envs: int,
        *,
        task: str,
        threads: int | None = None,
        autoreset_mode: str = AutoresetMode.NEXT_STEP.value,
        **settings: Any,
    ) -> None:
        threads = _usable_cores() if threads is None else threads
        require_integer("num_envs", num_envs, 1)
        require_integer("threads", threads, 1)
        require_choice("autoreset_mode", autoreset_mode, AUTORESET_MODES)
        make_env = resolve_name(task_spec("task", task).env_entry)
        self._pool = ThreadPoolExecutor(max_workers=min(threads, num_envs), thread_name_prefix="world")
        self._worlds = [_Ahead(make_env(task=task, **settings), self._pool) for _ in range(num_envs)]
        self._has_ended: NDArray[np.bool_] = np.zeros(num_envs, dtype=bool)
        makers: list[Callable[[], gym.Env[Any, Any]]] = [partial(_itself, world) for world in self._worlds]
        super().__init__(makers, autoreset_mode=autoreset_mode)

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Reset every world, or those of `options["reset_mask"]`, all at the same time."""
        told = None if options is None else {name: value for name, value in options.items() if name != "reset_mask"}
        mask = (options or {}).get("reset_mask")
        chosen = np.ones(self.num_envs, dtype=bool) if mask is None else mask
        if np.shape(chosen) == (self.num_envs,):  # Gymnasium refuses others
            for i in np.flatnonzero(chosen).tolist():
                self._worlds[i].begin_reset(seed=_seed_of(i, seed), options=told)
            self._has_ended[chosen] = False
        return self._when_all_are_done(lambda: super(ManyWorlds, self).reset(seed=seed, options=options))

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Let a frame pass in every world, in as many at the same time as there are threads."""
        begins_again = self._has_ended & (self.autoreset_mode == AutoresetMode.NEXT_STEP)
        each = zip(self._worlds, iterate(self.action_space, actions), begins_again, strict=True)
        for world, action, is_new in each:
            world.begin_reset() if is_new else world.begin_step(action)
        stepped = self._when_all_are_done(lambda: super(ManyWorlds, self).step(actions))
        self._has_ended = stepped[2] | stepped[3]
        return stepped

    def _when_all_are_done[Result](self, collect: Callable[[], Result]) -> Result:
        """Wait for what was begun, then collect it; where one world fails, nothing of the others is left for later."""
        wait([world.begun for world in self._worlds if world.begun is not None])
        try:
            return collect()
        finally:
            for world in self._worlds:
                world.begun = None

    def close_extras(self, **kwargs: Any) -> None:
        """Close the worlds, then their threads."""
        super().close_extras(**kwargs)
        self._pool.shutdown()


class _Ahead(gym.Wrapper[Any, Any, Any, Any]):
    """An environment whose next `step` or `reset` may be under way already."""

    def __init__(self, env: gym.Env[Any, Any], pool: ThreadPoolExecutor) -> None:
        super().__init__(env)
        self._pool = pool
        self.begun: Future[Any] | None = None

    def begin_step(self, action: Any) -> None:
        self.begun = self._pool.submit(self.env.step, action)

    def begin_reset(self, **how: Any) -> None:
        self.begun = self._pool.submit(self.env.reset, **how)

    def step(self, action: Any) -> Any:
        return self._result() if self.begun else self.env.step(action)

    def reset(self, **how: Any) -> Any:
        return self._result() if self.begun else self.env.reset(**how)

    def _result(self) -> Any:
        begun, self.begun = self.begun, None
        assert begun is not None
        return begun.result()


def _itself(world: _Ahead) -> _Ahead:
    return world


def _seed_of(index: int, seed: Any) -> int | None:
    """Return the seed of one world, as Gymnasium spells it out."""
    if seed is None or isinstance(seed, int):
        return None if seed is None else seed + index
    return seed[index] if index < len(seed) else None  # Gymnasium refuses lists of another length


def _usable_cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
