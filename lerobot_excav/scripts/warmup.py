"""Compile the simulation ahead of the first episode.

The soil and the machine are computed by code that is compiled at first use, which takes about a minute. The code is
kept, so that this happens once per installation; `make setup` has done it already.

Examples:
  lerobot-excav warmup
      the excavator
"""

import time
from contextlib import closing
from dataclasses import dataclass, field

from lerobot_excav.envs.tasks.registry import task_of_settings
from lerobot_excav.scripts.arguments import Arguments, EnvironmentChoice


@dataclass(kw_only=True)
class WarmupArguments(Arguments):
    """Arguments of `lerobot-excav warmup`."""

    env: EnvironmentChoice = field(default_factory=EnvironmentChoice.default)
    """Environment, with its settings; the excavator by default."""


def run(arguments: WarmupArguments) -> int:
    """Start an episode, without pictures."""
    start, spec = time.perf_counter(), task_of_settings(arguments.env)
    with closing(spec.make_env(obs_type="agent_pos", render_mode=None, **arguments.env.as_dict())) as env:
        env.reset(options={"scene_id": 0, "target_id": 0})
    print(f"{spec.id} is ready: an episode started after {time.perf_counter() - start:.1f} s")
    return 0


ARGUMENTS = WarmupArguments
