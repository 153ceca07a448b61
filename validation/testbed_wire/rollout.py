"""Stock `lerobot-rollout` and the emulator, each in a process of its own, until some cycles are over."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from lerobot_excav.page.access import free_port

HOST = "127.0.0.1"
PATIENCE_S = 180.0
"""Longest time without the end of a cycle (kind: guess; a cycle has a limit of 20 s, and programs start within 60)."""

LAST_LINES = 8
"""Lines of a log that an error tells."""

POLICY = ("--policy.device=cpu", "--policy.n_action_steps=5")
LEROBOT = ("--fps=10", "--play_sounds=false", "--return_to_initial_position=false")


class Wire(NamedTuple):
    """A condition."""

    delay_ms: int  # each way
    loss: float  # share of the datagrams, each way


def cycles_behind(
    wire: Wire, *, checkpoint: Path, scene_set: str, first_scene: int, count: int, folder: Path
) -> Iterator[dict[str, Any]]:
    """Let a policy drive the emulated machine; yield the metrics of each cycle when it is over.

    Args:
        wire: The wire between them.
        checkpoint: The policy.
        scene_set: Scenes of the machine's worksite.
        first_scene: The first of them; each has four targets, one cycle each.
        count: Number of cycles.
        folder: Where logs and metrics go; must be empty.

    Raises:
        RuntimeError: A program ended before that, or no cycle ended for long.
    """
    folder.mkdir(parents=True, exist_ok=True)
    metrics, ports = folder / "metrics.jsonl", (free_port(HOST), free_port(HOST))
    emulator = [*_command("lerobot_excav.scripts.main"), "testbed-emulator", f"--env.scene_set={scene_set}"]
    emulator += [f"--port={ports[0]}", f"--picture_port={ports[1]}", f"--first_scene={first_scene}", "--soak_s=2"]
    emulator += [f"--delay_ms={wire.delay_ms}", f"--loss={wire.loss}", f"--metrics={metrics}"]
    rollout = [*_command("lerobot.scripts.lerobot_rollout"), "--strategy.type=base", f"--policy.path={checkpoint}"]
    rollout += ["--robot.type=excavator_testbed", f"--robot.address={HOST}:{ports[0]}", *POLICY, *LEROBOT]
    rollout += [f"--robot.cameras={_cameras(ports[1])}", f"--robot.alignment_log={folder / 'alignment.jsonl'}"]
    rollout += [f"--robot.calibration_dir={folder}", "--task=dig", f"--duration={count * 60}"]
    with _running(emulator, folder / "emulator.log") as machine:
        _wait_for_line(folder / "emulator.log", "its cameras", machine)
        with _running(rollout, folder / "rollout.log") as host:
            for number in range(count):
                yield _next_cycle(metrics, number, (machine, host))


def late_ticks(folder: Path) -> str:
    """Return what the emulator says of the ticks of 20 ms that it could not make in time."""
    lines = [
        line
        for line in (folder / "emulator.log").read_text(encoding="utf-8").splitlines()
        if "ticks took longer" in line
    ]
    return lines[-1] if lines else "the emulator had to be killed, and says nothing of its ticks"


def _command(module: str) -> list[str]:
    return [sys.executable, "-m", module]


def _cameras(port: int) -> str:
    names = ("main", "cab", "target_mask")
    cameras = {
        name: {"type": "stream", "port": port, "name": name, "fps": 10, "width": 128, "height": 96} for name in names
    }
    return str(cameras).replace("'", "")


@contextmanager
def _running(command: list[str], log: Path) -> Iterator[subprocess.Popen[bytes]]:
    with log.open("wb") as file:
        process = subprocess.Popen(command, stdout=file, stderr=file, env={**os.environ, "OMP_NUM_THREADS": "1"})
    try:
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(timeout=60.0)
        except subprocess.TimeoutExpired:
            process.kill()


def _wait_for_line(log: Path, words: str, process: subprocess.Popen[bytes]) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while words not in log.read_text(encoding="utf-8"):
        if process.poll() is not None or time.monotonic() > deadline:
            raise RuntimeError(f"the emulator did not start; the logs end in\n{_ends_of_logs(log.parent)}")
        time.sleep(0.2)


def _ends_of_logs(folder: Path) -> str:
    """Return the last lines of both programs, for their folder is temporary."""
    logs = ((path.name, path.read_text(encoding="utf-8").splitlines()) for path in sorted(folder.glob("*.log")))
    return "\n".join(f"{name}: {line}" for name, lines in logs for line in lines[-LAST_LINES:])


def _next_cycle(metrics: Path, number: int, processes: tuple[subprocess.Popen[bytes], ...]) -> dict[str, Any]:
    deadline = time.monotonic() + PATIENCE_S
    while True:
        lines = metrics.read_text(encoding="utf-8").splitlines(keepends=True) if metrics.exists() else []
        if len(lines) > number and lines[number].endswith("\n"):
            cycle: dict[str, Any] = json.loads(lines[number])
            return cycle
        if any(process.poll() is not None for process in processes) or time.monotonic() > deadline:
            raise RuntimeError(f"cycle {number} did not end; the logs end in\n{_ends_of_logs(metrics.parent)}")
        time.sleep(0.2)
