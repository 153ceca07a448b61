"""Let the excavator's policy drive the emulated test bed behind wires that are late or lose datagrams; count successes.

Stock `lerobot-rollout` drives `lerobot-excav testbed-emulator` in real time, on scenes of `val`. Finished scenes, of
four cycles each, are kept in FILE, and the same command goes on after an interruption. Run it with nothing else at
work: it tells how many ticks of every condition could not be made in time.

Examples:
  python -m validation.testbed_wire
      12 cycles a condition (half an hour), then the table
  python -m validation.testbed_wire --cycles=4 --delays=0,200 --losses= --file=outputs/wire.jsonl
      a quick look
"""

import argparse
import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from validation.finished_plays import read_finished
from validation.rate_words import rate_words
from validation.testbed_wire.rollout import Wire, cycles_behind, late_ticks
from validation.whole_numbers import whole_numbers

FILE = Path("results", "scoop", "testbed_wire.jsonl")
CHECKPOINT = Path("results", "excavator", "checkpoints", "paired_token-1000")  # that all conditions were driven by
DELAYS_MS, LOSSES_PERCENT = (0, 25, 50, 100), (5, 20, 50)
SCENE_SET = "val"
KEPT = ("scene_id", "target_id", "simulation_version", "is_success", "target_success", "retained_mass_kg")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        "python -m validation.testbed_wire",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--cycles", type=int, default=12, help="cycles per condition, a multiple of 4 (default: 12)")
    parser.add_argument("--delays", type=whole_numbers, default=DELAYS_MS, help=f"each way [ms] (default: {DELAYS_MS})")
    parser.add_argument(
        "--losses", type=whole_numbers, default=LOSSES_PERCENT, help=f"[%%] (default: {LOSSES_PERCENT})"
    )
    parser.add_argument("--policy", type=Path, default=CHECKPOINT, help=f"checkpoint (default: {CHECKPOINT})")
    parser.add_argument("--file", type=Path, default=FILE, help=f"finished cycles (default: {FILE})")
    given = parser.parse_args(arguments)
    if given.cycles < 4 or given.cycles % SCOOP.target_count:
        parser.error(f"--cycles={given.cycles}; allowed: multiples of {SCOOP.target_count}, which a scene has targets")
    if max(given.losses, default=0) > 100 or min((*given.losses, *given.delays), default=0) < 0:
        parser.error("--losses and --delays; allowed: 0 to 100 %, and 0 ms and above")
    wires = [Wire(delay, 0.0) for delay in given.delays] + [Wire(0, share / 100) for share in given.losses]
    for wire in wires:
        _play(wire, given.policy, given.cycles, given.file)
    played = read_finished(given.file)
    print("\n".join(table([(wire, _of(played, wire, given.policy.name)[: given.cycles]) for wire in wires])))
    return 0


def _of(played: Sequence[dict[str, Any]], wire: Wire, policy: str) -> list[dict[str, Any]]:
    """Return the cycles of a condition, each once, in the order of scenes and targets."""
    key = (*wire, policy)
    cycles = [cycle for cycle in played if (cycle["delay_ms"], cycle["loss"], cycle["policy"]) == key]
    by_start = {(cycle["scene_id"], cycle["target_id"]): cycle for cycle in cycles}
    return [by_start[start] for start in sorted(by_start)]


def _play(wire: Wire, policy: Path, cycles: int, path: Path) -> None:
    """Play the scenes that are missing of a condition.

    Each begins with programs of its own: to make another scene can take the emulator longer than the robot waits for a
    picture.
    """
    done = len(_of(read_finished(path), wire, policy.name)) // SCOOP.target_count
    for scene_id in range(done, cycles // SCOOP.target_count):
        _play_scene(wire, policy, scene_id, path)


def _play_scene(wire: Wire, policy: Path, scene_id: int, path: Path) -> None:
    """Play a cycle for each target of a scene; they are kept when all are over."""
    path.parent.mkdir(parents=True, exist_ok=True)
    scene: list[dict[str, Any]] = []
    options: dict[str, Any] = {"checkpoint": policy, "scene_set": SCENE_SET, "first_scene": scene_id}
    with tempfile.TemporaryDirectory() as folder:
        for cycle in cycles_behind(wire, count=SCOOP.target_count, folder=Path(folder), **options):
            scene.append({**wire._asdict(), "policy": policy.name, **{name: cycle[name] for name in KEPT}})
            words = "success" if cycle["is_success"] else "no success"
            print(
                f"{wire.delay_ms} ms, {wire.loss:.0%} lost: scene {scene_id}, cycle {len(scene)}: {words}", flush=True
            )
        print(late_ticks(Path(folder)), flush=True)
    with path.open("a", encoding="utf-8") as file:
        file.write("".join(json.dumps(line) + "\n" for line in scene))


def table(conditions: Sequence[tuple[Wire, Sequence[dict[str, Any]]]]) -> list[str]:
    """Return success and hits by condition, as lines of a table."""
    lines = ["| delay each way | lost | success | region hit | retained |", "|---|---|---|---|---|"]
    for wire, cycles in conditions:
        if not cycles:
            continue
        n = len(cycles)
        names = ("is_success", "target_success")
        rates = [rate_words(sum(bool(cycle[name]) for cycle in cycles), n) for name in names]
        mass_kg = sum(cycle["retained_mass_kg"] for cycle in cycles) / n
        lines.append(f"| {wire.delay_ms} ms | {wire.loss:.0%} | {rates[0]} | {rates[1]} | {mass_kg:.0f} kg |")
    return lines


if __name__ == "__main__":
    sys.exit(main())
