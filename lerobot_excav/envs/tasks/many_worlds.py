"""Many worlds in one process: a vector environment whose worlds may step at the same time, in threads.

Soil kernels and MuJoCo let other threads run while they work; Python between them does not, and today takes more than
threads bring (`bench/many_worlds.py`), so that one thread is the default. What a world does depends on its own seed and
actions alone.
"""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from functools import partial
from pkgutil import resolve_name
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.vector.utils import iterate

from lerobot_excav.envs.tasks.registry import task_spec
from lerobot_excav.errors import require, require_choice, require_integer

AUTORESET_MODES = tuple(mode.value for mode in AutoresetMode)


class ManyWorlds(SyncVectorEnv):
    """Worlds of one task; what `gym.make_vec("lerobot_excav/…", num_envs=n)` makes.

    Observations, rewards, ends and infos are those of Gymnasium's `SyncVectorEnv` of the same environments, bit by bit.

    Args:
        num_envs: How many worlds.
        task: Id of the task.
        threads: How many of them step at the same time.
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
        threads: int = 1,
        autoreset_mode: str = AutoresetMode.NEXT_STEP.value,
        **settings: Any,
    ) -> None:
        require_integer("num_envs", num_envs, 1)
        require_integer("threads", threads, 1)
        require_choice("autoreset_mode", autoreset_mode, AUTORESET_MODES)
        make_env = resolve_name(task_spec("task", task).env_entry)
        self._pool = ThreadPoolExecutor(max_workers=min(threads, num_envs), thread_name_prefix="world")
        self._worlds = [_Ahead(make_env(task=task, **settings), self._pool) for _ in range(num_envs)]
        makers: list[Callable[[], gym.Env[Any, Any]]] = [partial(_itself, world) for world in self._worlds]
        super().__init__(makers, autoreset_mode=autoreset_mode)

    def reset(self, *, seed: Any = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Reset every world, or those of `options["reset_mask"]`, all at the same time."""
        seeds, chosen = _seeds(seed, self.num_envs), _chosen(options, self.num_envs)
        told = None if options is None else {name: value for name, value in options.items() if name != "reset_mask"}
        calls = {i: partial(self._worlds[i].env.reset, seed=seeds[i], options=told) for i in chosen if seeds}
        return self._ahead(calls, lambda: super(ManyWorlds, self).reset(seed=seed, options=options))

    def step(self, actions: Any) -> tuple[Any, Any, Any, Any, dict[str, Any]]:
        """Let a frame pass in every world, in as many at the same time as there are threads.

        Raises:
            ConfigurationError: There are not as many actions as worlds, a world refuses its own, or one has ended and
                is not reset by itself.
        """
        each = list(iterate(self.action_space, actions))
        require(len(each) == self.num_envs, f"{len(each)} actions were given; give {self.num_envs}, one to each world")
        require(
            self.autoreset_mode != AutoresetMode.DISABLED or not self._autoreset_envs.any(),
            f"the episodes of worlds {np.flatnonzero(self._autoreset_envs).tolist()} are over, and "
            "autoreset_mode='Disabled' begins none by itself; call reset(options={'reset_mask': ...}) first",
        )
        begins_again = self._autoreset_envs & (self.autoreset_mode == AutoresetMode.NEXT_STEP)
        calls: dict[int, Callable[[], Any]] = {
            i: world.env.reset if begins_again[i] else partial(world.env.step, each[i])
            for i, world in enumerate(self._worlds)
        }
        return self._ahead(calls, lambda: super(ManyWorlds, self).step(actions))

    def _ahead[Result](self, calls: Mapping[int, Callable[[], Any]], collect: Callable[[], Result]) -> Result:
        """Begin calls of worlds, by their numbers, then let Gymnasium collect what came of them.

        Where one fails, the others come to their end, and nothing of them is left for later.
        """
        try:
            for i, call in calls.items():
                self._worlds[i].begin(call)
            return collect()
        finally:
            wait([world.begun for world in self._worlds if world.begun is not None])
            for world in self._worlds:
                world.begun = None

    def close_extras(self, **kwargs: Any) -> None:
        """Let the threads come to their end, then close the worlds."""
        if hasattr(self, "_pool"):  # it was made with settings that are possible
            self._pool.shutdown(cancel_futures=True)
        super().close_extras(**kwargs)


class _Ahead(gym.Wrapper[Any, Any, Any, Any]):
    """An environment whose next `step` or `reset` may be under way already."""

    def __init__(self, env: gym.Env[Any, Any], pool: ThreadPoolExecutor) -> None:
        super().__init__(env)
        self._pool = pool
        self.begun: Future[Any] | None = None

    def begin(self, call: Callable[[], Any]) -> None:
        self.begun = self._pool.submit(call)

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


def _seeds(seed: Any, worlds: int) -> Sequence[int | None]:
    """Return the seed of every world, as Gymnasium spells it out; none if it refuses them."""
    if seed is None or isinstance(seed, int):
        return [None if seed is None else seed + i for i in range(worlds)]
    return seed if len(seed) == worlds else []


def _chosen(options: dict[str, Any] | None, worlds: int) -> list[int]:
    """Return the numbers of the worlds to be reset; none if Gymnasium refuses the mask that chooses them."""
    if options is None or "reset_mask" not in options:
        return list(range(worlds))
    mask = options["reset_mask"]
    is_sound = isinstance(mask, np.ndarray) and mask.shape == (worlds,) and mask.dtype == np.bool_
    return np.flatnonzero(mask).tolist() if is_sound else []
