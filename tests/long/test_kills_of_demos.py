"""`lerobot-excav demos`, killed a hundred times at any moment: nothing that was finished is lost or played twice.

Not part of the default run. Every kill is a SIGKILL to the whole process group of the command, which the next
`--resume=true` follows.
"""

import json
import os
import random
import select
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

import pytest

from ..datasets.record.test_demonstrations import contents

KILLS = int(os.environ.get("EXCAV_KILLS", "100"))
SCENES, TARGETS = 2, 4
OPTIONS = ["--env.type=toy_reach", f"--scenes={SCENES}", f"--targets={TARGETS}", "--keep_failures",
           "--env.observation_height=32", "--env.observation_width=32", "--resume=true"]  # fmt: skip


class Launcher:
    """Starts one command after the other."""

    def __init__(self, folder):
        self.played, self.log = folder / "played", folder / "log"
        command = [sys.executable, str(Path(__file__).with_name("demos_launcher.py"))]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)

    def start(self, out, workers):
        """Start a command; returns its process group."""
        options = [*OPTIONS, f"--out={out}", f"--workers={workers}"]
        self._process.stdin.write((json.dumps([options, str(self.played), str(self.log)]) + "\n").encode())
        return int(self._process.stdout.readline())

    def exit_code(self, timeout_s=None):
        """Wait for the command; None if it is still at work when the time is over."""
        if timeout_s is not None and not select.select([self._process.stdout], [], [], timeout_s)[0]:
            return None
        return int(self._process.stdout.readline())

    def run(self, out, workers):
        self.start(out, workers)
        assert self.exit_code() == 0, self.log.read_text(encoding="utf-8")

    def close(self):
        self._process.stdin.close()
        self._process.wait()


@pytest.fixture
def launcher(tmp_path):
    launcher = Launcher(tmp_path)
    yield launcher
    launcher.close()


def finished(out):
    """Return what identifies each finished episode on disk: another file would be another playing."""
    folder = out.with_name(f"{out.name}.partial") / "episodes"
    return {path.name: (path.stat().st_ino, path.stat().st_mtime_ns) for path in folder.glob("[!.]*.json")}


def stage(out):
    partial = out.with_name(f"{out.name}.partial")
    if out.exists():
        return "published, not tidied" if partial.exists() else "done"
    if not (partial / "settings.json").exists():
        return "before the settings"
    number = len(finished(out))
    known = "none" if number == 0 else "all" if number == SCENES * TARGETS else "some"
    return f"{known} finished, {'assembling' if (partial / 'dataset').exists() else 'not assembling'}"


def test_after_any_number_of_kills_the_dataset_is_the_undisturbed_one(launcher, tmp_path):
    whole, seconds = tmp_path / "whole", {}
    launcher.run(tmp_path / "first", 0)  # waits until the libraries are loaded
    for workers in (0, 2):
        begun = time.monotonic()
        launcher.run(whole / str(workers), workers)
        seconds[workers] = time.monotonic() - begun
    expected = contents(whole / "0")
    assert contents(whole / "2") == expected

    rng, kills, where, runs, repeated = random.Random(11), Counter(), Counter(), 0, 0
    while kills.total() < KILLS:
        workers, out, here = 2 * (runs % 3 == 2), tmp_path / f"run{runs}", 0
        runs += 1
        launcher.played.write_text("", encoding="utf-8")
        before, code = {}, None
        while kills.total() < KILLS:
            group = launcher.start(out, workers)
            if (code := launcher.exit_code(rng.uniform(0.0, seconds[workers]))) is not None:
                break
            with suppress(ProcessLookupError):
                os.killpg(group, signal.SIGKILL)
            if (code := launcher.exit_code()) != -signal.SIGKILL:
                break  # it ended just before
            code = None
            where[stage(out)] += 1
            kills[workers] += 1
            here += 1
            if not out.exists():
                after = finished(out)
                assert before.items() <= after.items(), "a finished episode was lost or played again"
                before = after
        if code is None:
            launcher.run(out, workers)
        else:
            assert code == 0, launcher.log.read_text(encoding="utf-8")
        assert contents(out) == expected
        assert not out.with_name(f"{out.name}.partial").exists()
        if workers == 0:
            begun = launcher.played.read_text(encoding="utf-8").splitlines()
            assert len(set(begun)) == SCENES * TARGETS
            assert len(begun) - SCENES * TARGETS <= here, "more than the episode in hand was played again"
            repeated += len(begun) - SCENES * TARGETS
        print(f"{kills.total()} kills in {runs} datasets, killed while {dict(where)}", flush=True)
    print(f"{kills.total()} kills by workers {dict(kills)} in {runs} datasets; {seconds} s undisturbed")
    print(f"episodes in hand that were played again, without workers: {repeated}; killed while {dict(where)}")
