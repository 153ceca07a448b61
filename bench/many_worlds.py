"""How many frames of many worlds pass in a second: one after another, in threads, in processes.

    python -m bench.many_worlds                          # 8 worlds of Scoop-v0
    python -m bench.many_worlds --task=FR5Grasp-v0 --worlds=32 --quick

Every world gets the same random actions, seen by `agent_pos` alone; pictures cost more than all of it. The ways take
turns, so that other work on the machine slows all of them alike; the ratio is to worlds one after another.
"""

import argparse
import os
import resource
import statistics
import sys
import time
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np

import lerobot_excav  # noqa: F401 - registers the tasks

VectorEnv = gym.vector.VectorEnv[Any, Any, Any]


def ways(gym_id: str, worlds: int) -> dict[str, Callable[[], VectorEnv]]:
    """Return what makes the worlds, by a name for it."""
    settings = {"obs_type": "agent_pos", "render_mode": None, "episode_length": 1_000_000}
    counts = [1, *(n for n in (2, 4, 8, 16, 32, 64, 128) if n <= len(os.sched_getaffinity(0)))]

    def made(mode: str, **how: Any) -> Callable[[], VectorEnv]:
        return lambda: gym.make_vec(gym_id, worlds, vectorization_mode=mode, **how, **settings)

    return {
        "one after another": made("sync"),
        **{f"{n} threads" if n > 1 else "1 thread": made("vector_entry_point", threads=n) for n in counts},
        "a process each": made("async", vector_kwargs={"context": "forkserver"}),
    }


def frames_per_s(vector: VectorEnv, actions: list[Any]) -> float:
    """Return how many frames of any world pass in a second."""
    began_s = time.perf_counter()
    for action in actions:
        vector.step(action)
    return len(actions) * vector.num_envs / (time.perf_counter() - began_s)


def memory_per_world_mib(gym_id: str, worlds: int) -> float:
    """Return by how much the most memory of this process grows with each further world [MiB]."""
    make = ways(gym_id, worlds)["one after another"]
    ways(gym_id, 1)["one after another"]().reset(seed=0)
    before_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    make().reset(seed=0)
    return (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kib) / 1024 / (worlds - 1)


def measure(task: str, worlds: int, *, rounds: int, frames: int) -> None:
    """Measure every way in turns, and print a table."""
    gym_id, cores = f"lerobot_excav/{task}", len(os.sched_getaffinity(0))
    print(
        f"{worlds} worlds of {task}, {cores} cores, {memory_per_world_mib(gym_id, worlds):.0f} MiB a world", flush=True
    )
    vectors = {name: make() for name, make in ways(gym_id, worlds).items()}
    rates: dict[str, list[float]] = {name: [] for name in vectors}
    rng = np.random.default_rng(0)
    for vector in vectors.values():
        vector.reset(seed=0)
    for number in range(rounds):
        shape = next(iter(vectors.values())).action_space.shape
        actions = [rng.uniform(-1.0, 1.0, shape).astype(np.float32) for _ in range(frames)]
        for name, vector in vectors.items():
            rates[name].append(frames_per_s(vector, actions))
        print(f"round {number + 1} of {rounds}", file=sys.stderr, flush=True)
    alone = rates["one after another"]
    print(f"{'worlds step':20} {'frames/s':>9} {'ratio':>6}")
    for name, measured in rates.items():
        ratio = statistics.median(a / b for a, b in zip(measured, alone, strict=True))
        print(f"{name:20} {statistics.median(measured):9.1f} {ratio:6.2f}")
        vectors[name].close()


def main() -> int:
    """Read the command line, and measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", default="Scoop-v0", help="id of the task (default: %(default)s)")
    parser.add_argument("--worlds", type=int, default=8, help="how many worlds, from 2 on (default: %(default)s)")
    parser.add_argument("--quick", action="store_true", help="two rounds of 20 frames instead of seven of 100")
    arguments = parser.parse_args()
    if arguments.worlds < 2:
        parser.error(f"--worlds={arguments.worlds} is too few to compare; give 2 or more")
    rounds, frames = (2, 20) if arguments.quick else (7, 100)
    measure(arguments.task, arguments.worlds, rounds=rounds, frames=frames)
    return 0


if __name__ == "__main__":
    sys.exit(main())
