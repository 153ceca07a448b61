"""How fast the operator's cycles are simulated, without pictures, and where the time goes.

    python -m bench.operator_cycle                        # every fidelity, three cycles each
    python -m bench.operator_cycle --fidelity=standard --scenes=8
    python bench/operator_cycle.py --scenes=4 --beside=../old_checkout

All times are those of the processor, on one core, so that other work on the machine disturbs little; what is left of
that disturbance changes from minute to minute, so two checkouts are compared with `--beside`: this one and the other
take turns, scene by scene, each in a process of its own, and the ratio of their times is printed.
"""

import argparse
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

ALL_FIDELITIES = ("fast", "standard", "fine")

PARTS = ("soil", "machine", "task", "operator", "reset")
"""What is timed; the rest of a cycle is the environment's own bookkeeping."""


class CycleTimes(NamedTuple):
    """Processor times of one cycle."""

    simulated_s: float
    cycle_s: float  # from the first command to the last, without the reset
    parts_s: dict[str, float]
    ticks_ms: list[float]  # soil, machine and task of every tick


class Stopwatch:
    """Adds up the processor time of calls by name."""

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(PARTS, 0.0)

    def timed[**P, R](self, part: str, function: Callable[P, R]) -> Callable[P, R]:
        """Return the function with a clock around it."""

        def clocked(*args: P.args, **kwargs: P.kwargs) -> R:
            with self.clock(part):
                return function(*args, **kwargs)

        return clocked

    @contextmanager
    def clock(self, part: str) -> Iterator[None]:
        """Add the time that passes inside to a part."""
        start = time.process_time()
        yield
        self.seconds[part] += time.process_time() - start


def play(env: Any, operator: Any, scene_id: int) -> CycleTimes:
    """Let the operator play one cycle and time it."""
    watch = Stopwatch()
    with watch.clock("reset"):
        env.reset(options={"scene_id": scene_id, "target_id": scene_id % 4})
        operator.reset(env)
    site, cycle, ticks_ms = env.worksite, env.cycle, []
    soil_step, machine_tick, update = site.soil.step, site.machine.tick, cycle.update
    site.soil.step, site.machine.tick = watch.timed("soil", soil_step), watch.timed("machine", machine_tick)
    site_tick, start_ms = site.tick, 0.0

    def tick(command: Any) -> Any:
        nonlocal start_ms
        start_ms = 1e3 * time.process_time()
        return site_tick(command)

    def update_and_note() -> None:
        with watch.clock("task"):
            update()
        ticks_ms.append(1e3 * time.process_time() - start_ms)

    site.tick, cycle.update = tick, update_and_note
    act, over, start = watch.timed("operator", operator.act), False, time.process_time()
    while not over:
        _, _, terminated, truncated, _ = env.step(act(env))
        over = terminated or truncated
    cycle_s = time.process_time() - start
    site.soil.step, site.machine.tick, site.tick = soil_step, machine_tick, site_tick
    return CycleTimes(site.time_s, cycle_s, watch.seconds, ticks_ms)


def cycles(fidelity: str) -> Callable[[int], CycleTimes]:
    """Return a function that plays a scene in an environment that stays open; the first cycle is played here."""
    from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
    from lerobot_excav.envs.tasks.scoop.operator import DigOperator

    env = ExcavatorEnv(obs_type="agent_pos", render_mode=None, fidelity=fidelity)
    operator = DigOperator(rng=np.random.default_rng(5))
    play(env, operator, 0)  # loads or compiles the kernels
    return lambda scene_id: play(env, operator, scene_id)


def report(fidelity: str, times: list[CycleTimes]) -> None:
    """Print what was measured."""
    total = sum(t.cycle_s for t in times)
    ticks = np.concatenate([t.ticks_ms for t in times])
    p50, p95 = np.percentile(ticks, (50, 95))
    print(
        f"{fidelity:9} {sum(t.simulated_s for t in times) / total:6.2f} x real time; "
        f"tick p50 {p50:.2f} ms, p95 {p95:.2f} ms, max {ticks.max():.1f} ms"
    )
    shares = {part: sum(t.parts_s[part] for t in times) / total for part in PARTS}
    shares["rest"] = 1.0 - sum(share for part, share in shares.items() if part != "reset")
    resets_ms = 1e3 * statistics.mean(t.parts_s["reset"] for t in times)
    print("          " + ", ".join(f"{part} {100 * s:.0f} %" for part, s in shares.items() if part != "reset"))
    print(f"          reset {resets_ms:.0f} ms, not part of the cycle", flush=True)


def serve(fidelity: str) -> None:
    """Play the scenes whose numbers come in, one a line, and answer with the time of each per simulated second."""
    run = cycles(fidelity)
    print("ready", flush=True)
    for line in sys.stdin:
        times = run(int(line))
        print(times.cycle_s / times.simulated_s, flush=True)


def compare(checkout: Path, fidelity: str, scenes: int) -> None:
    """Let this checkout and another take turns, and print how they compare."""
    roots = (Path(__file__).parents[1], checkout.resolve())
    workers = [_worker(root, fidelity) for root in roots]
    for worker in workers:
        _answer(worker)
    ratios = []
    for scene_id in range(1, scenes + 1):
        own, other = (_answer(worker, f"{scene_id}\n") for worker in workers)
        ratios.append(float(other) / float(own))
        speeds = f"{1 / float(own):6.2f} and {1 / float(other):6.2f} x real time"
        print(f"{fidelity:9} scene {scene_id}: {speeds}, {ratios[-1]:.2f} times as fast", flush=True)
    print(f"{fidelity:9} {statistics.median(ratios):.2f} times as fast as {checkout} in the median")
    for worker in workers:
        worker.stdin.close()
        worker.wait()


def _worker(root: Path, fidelity: str) -> Any:
    # This very file on the other checkout's package: it need not have the file.
    command = [sys.executable, __file__, "--serve", f"--fidelity={fidelity}"]
    environment = {**os.environ, "PYTHONPATH": str(root)}
    pipe = subprocess.PIPE
    return subprocess.Popen(command, cwd=root, env=environment, encoding="utf-8", stdin=pipe, stdout=pipe)


def _answer(worker: Any, question: str = "") -> str:
    worker.stdin.write(question)
    worker.stdin.flush()
    answer: str = worker.stdout.readline()
    return answer


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fidelity", choices=ALL_FIDELITIES, help="left out: every one")
    parser.add_argument("--scenes", type=int, default=3, help="how many cycles are timed")
    parser.add_argument("--beside", type=Path, help="another checkout to compare with")
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    for fidelity in ALL_FIDELITIES if arguments.fidelity is None else (arguments.fidelity,):
        if arguments.serve:
            serve(fidelity)
        elif arguments.beside is not None:
            compare(arguments.beside, fidelity, arguments.scenes)
        else:
            run = cycles(fidelity)
            report(fidelity, [run(scene_id) for scene_id in range(1, arguments.scenes + 1)])


if __name__ == "__main__":
    main()
