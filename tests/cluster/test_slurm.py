"""The excavator's workflow on a real SLURM whose node dies on the way: what comes out is what one machine makes."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from lerobot.datasets.lerobot_dataset import LeRobotDataset

from .one_machine import PROGRAMS, Slurm

ROOT = Path(__file__).parents[2]
PROFILE = ROOT / "workflows/excavator/profiles/slurm"
SIZES = ("paired_scenes=4", "stages=0", "data_shards=4", "scoops=2", "play_shards=2")
DATA, ROW = "outputs/trial/data/paired", "outputs/page/metrics/scoop_paired_token-1000.jsonl"
RANDOM_NAMES = ("evaluation", "started_at")  # of an evaluation, not of what it measured


def workflow(folder, *options):
    """Return the command that records paired data and plays a policy that has landed, from a folder."""
    landed = folder / "outputs/page/checkpoints"
    shutil.copytree(ROOT / "checkpoints/excavator_mask_act", landed / "paired_token-1000")
    config = ["--config", "out=outputs/trial", "results=outputs/page", *SIZES]
    snakefile = ["-s", str(ROOT / "workflows/excavator/Snakefile"), "-d", str(folder)]
    # Targets come first: what takes several words would take them, too.
    return [sys.executable, "-m", "snakemake", DATA, ROW, *snakefile, *config, *options]


def environment(of=os.environ):
    path = f"{of['PATH']}{os.pathsep}{Path(sys.executable).parent}"
    return {**of, "PATH": path, "PYTHONPATH": str(ROOT)}


@pytest.fixture(scope="module")
def slurm(tmp_path_factory):
    missing = [program for program in PROGRAMS if shutil.which(program) is None]
    assert not missing, f"{', '.join(missing)}: not installed; on Debian: apt-get install slurm-wlm munge"
    cluster = Slurm(tmp_path_factory.mktemp("slurm") / "cluster")
    try:
        cluster.start()
        yield cluster
    finally:
        cluster.stop()


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """What one machine makes without SLURM."""
    folder = tmp_path_factory.mktemp("undisturbed")
    done = subprocess.run(
        workflow(folder, "--cores=2"), env=environment(), cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    return folder


def recorded_on(slurm, node, folder):
    """Return the jobs of a node if a recording there has written an episode, and has not finished."""
    shards = re.findall(r"--first_scene=(\d+) --scenes=(\d+)", " ".join(slurm.commands_on(node)))
    parts = [folder / f"outputs/trial/shards/paired/{first}-{number}.partial/episodes" for first, number in shards]
    return slurm.jobs_on(node) if any(list(part.glob("*.npz")) for part in parts) else []


@pytest.fixture(scope="module")
def disturbed(slurm, tmp_path_factory):
    """What the cluster makes when one of its two nodes dies in the middle of a recording."""
    folder = tmp_path_factory.mktemp("disturbed")
    hurried = ["--slurm-init-seconds-before-status-checks=5", "--slurm-no-account", "--slurm-status-command=squeue"]
    small = ["--default-resources", "mem_mb=1000", "runtime=60", "cpus_per_task=1"]
    command = workflow(folder, "--profile", str(PROFILE), "--latency-wait=10", *hurried, *small)
    with (folder / "log").open("w") as log:
        running = subprocess.Popen(command, env=environment(slurm.environment), cwd=ROOT, stdout=log, stderr=log)
        try:
            slurm.wait_for(lambda: running.poll() is not None or recorded_on(slurm, "two", folder), limit_s=600.0)
            lost = recorded_on(slurm, "two", folder)
            slurm.pull_the_plug("two")
            assert lost, (folder / "log").read_text()[-3000:]
            code = running.wait(timeout=2400.0)
        finally:
            running.kill()
    assert code == 0, (folder / "log").read_text()[-5000:]
    return SimpleNamespace(folder=folder, lost=lost)


def row(folder):
    return [json.loads(line) for line in (folder / ROW).read_text().splitlines()]


def frames(folder):
    return LeRobotDataset("local/excavator_paired", root=folder / DATA)


def test_the_dataset_is_the_same_in_every_value_and_pixel(undisturbed, disturbed):
    ours, theirs = frames(disturbed.folder), frames(undisturbed)
    assert len(ours) == len(theirs) > 0
    assert ours.meta.total_episodes == theirs.meta.total_episodes
    for index in range(len(theirs)):
        mine, other = ours[index], theirs[index]
        assert set(mine) == set(other)
        for name, value in other.items():
            assert np.array_equal(mine[name], value), (index, name)


def test_the_row_is_the_same(undisturbed, disturbed):
    ours, theirs = row(disturbed.folder), row(undisturbed)
    assert len(ours) == len(theirs) == 2
    for mine, other in zip(ours, theirs, strict=True):
        assert mine.keys() == other.keys()
        for name in other.keys() - set(RANDOM_NAMES):
            assert mine[name] == other[name], name


def test_the_lost_job_was_begun_again_and_the_dead_node_is_down(slurm, disturbed):
    assert [slurm.restarts_of(job) for job in disturbed.lost] == [1] * len(disturbed.lost)
    assert slurm.say("sinfo", "-h", "-n", "two", "-o", "%t").strip().startswith("down")
    assert slurm.say("squeue", "-h").strip() == ""
