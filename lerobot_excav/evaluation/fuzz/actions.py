"""Styles of random actions: some wander in the air, some press into the ground, some carry soil to the box."""

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.operator import ScriptedOperator
from lerobot_excav.envs.tasks.scoop.operator.path import UnreachableError

Action = NDArray[np.float32]
Style = Callable[[ExcavatorEnv, np.random.Generator], Iterator[Action]]

_LONGEST_HOLD = 30
_JITTER = 0.05
_DISTURBANCE = 0.3
_AWAY_STEPS = 20


def noise(env: ExcavatorEnv, rng: np.random.Generator) -> Iterator[Action]:
    """Draw every command of every frame anew."""
    while True:
        yield _float32(rng.uniform(-1.0, 1.0, 4))


def held(env: ExcavatorEnv, rng: np.random.Generator) -> Iterator[Action]:
    """Hold random commands, each joint for a random time of its own."""
    command, frames_left = np.zeros(4), np.zeros(4, dtype=int)
    while True:
        over = frames_left == 0
        command[over] = rng.uniform(-1.0, 1.0, over.sum())
        frames_left[over] = rng.integers(1, _LONGEST_HOLD, over.sum())
        frames_left -= 1
        yield _float32(command)


def full(env: ExcavatorEnv, rng: np.random.Generator) -> Iterator[Action]:
    """Push every stick to one end or the other, all together, for random times."""
    while True:
        command = _float32(rng.choice([-1.0, 1.0], 4))
        for _ in range(rng.integers(1, _LONGEST_HOLD)):
            yield command


def press(env: ExcavatorEnv, rng: np.random.Generator) -> Iterator[Action]:
    """Swing over the pile, then press the bucket into it while it turns and drags; now and then let go."""
    swing = env.worksite.machine.joint_pos[0]
    for _ in range(round(abs(swing) * env.fps)):
        yield _float32(np.array([-np.sign(swing), 0.0, 0.0, 0.0]))
    while True:
        down = np.array([rng.uniform(-0.1, 0.1), -1.0, *rng.uniform(-1.0, 1.0, 2)])
        for command in (down, rng.uniform(-1.0, 1.0, 4)):
            for _ in range(rng.integers(1, _LONGEST_HOLD)):
                yield _float32(command)


def jitter(env: ExcavatorEnv, rng: np.random.Generator) -> Iterator[Action]:
    """Press the bucket into the soil, then tremble around zero: creep and chatter show there."""
    pressing = press(env, rng)
    for _ in range(rng.integers(20, 80)):
        yield next(pressing)
    while True:
        yield _float32(rng.uniform(-_JITTER, _JITTER, 4))


def dig(env: ExcavatorEnv, rng: np.random.Generator) -> Iterator[Action]:
    """Dig, carry and dump like the scripted operator, with disturbances; then begin again."""
    while True:
        yield from _operated(env, rng, until="rest")
        held_for_a_while = held(env, rng)
        for _ in range(_AWAY_STEPS):
            yield next(held_for_a_while)


def spill(env: ExcavatorEnv, rng: np.random.Generator) -> Iterator[Action]:
    """Dig like the scripted operator until the bucket is loaded, then lose the load by full deflections."""
    yield from _operated(env, rng, until="lift")
    yield from full(env, rng)


def _operated(env: ExcavatorEnv, rng: np.random.Generator, *, until: str) -> Iterator[Action]:
    """Act like the scripted operator, with disturbances, until a phase begins or it can go on no more."""
    operator = ScriptedOperator(rng=rng)
    try:
        operator.reset(env)
        while operator.phase != until:
            yield _disturbed(operator.act(env), rng)
    except UnreachableError:  # disturbed too far: its next path leads out of the machine's reach
        return


STYLES: dict[str, Style] = {
    "noise": noise,
    "held": held,
    "full": full,
    "press": press,
    "jitter": jitter,
    "dig": dig,
    "spill": spill,
}
"""All styles by name."""


def _disturbed(action: Action, rng: np.random.Generator) -> Action:
    return _float32(np.clip(action + rng.normal(0.0, _DISTURBANCE, 4), -1.0, 1.0))


def _float32(values: NDArray[np.floating]) -> Action:
    return np.asarray(values, dtype=np.float32)
