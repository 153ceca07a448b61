"""A SLURM of two nodes on this machine alone, in a folder of its own, with a key of its own."""

import os
import re
import secrets
import shutil
import signal
import socket
import subprocess
import time
from contextlib import suppress
from pathlib import Path

from lerobot_excav.page.access import free_port

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "srun")
NODES = ("one", "two")

CONF = """
ClusterName=bench
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={port}
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CryptoType=crypto/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.%n.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=2,bf_interval=2
SlurmdTimeout=10
ReturnToService=2
MinJobAge=3600
{nodes}
PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


class Slurm:
    """What a test does to a running cluster.

    Attributes:
        environment: Variables with which SLURM's commands find it.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        conf = {"SLURM_CONF": str(folder / "slurm.conf"), "PATH": f"{folder}/bin{os.pathsep}{os.environ['PATH']}"}
        self.environment = {**os.environ, **conf}
        self._processes: dict[str, subprocess.Popen[bytes]] = {}

    def start(self) -> None:
        """Start the key's daemon, the controller and the nodes; wait until both nodes are idle."""
        (self.folder / "state").mkdir(parents=True)
        key = self.folder / "munge.key"
        key.write_bytes(secrets.token_bytes(128))
        key.chmod(0o400)
        self._write_configuration()
        self._write_srun()
        files = [f"--{name}={self.folder}/munge.{name}" for name in ("socket", "pid-file", "log-file", "seed-file")]
        self._run("munged", f"--key-file={key}", "--foreground", "--force", *files)
        self._run("slurmctld", "-D", "-i")
        for node in NODES:
            self._run(node, "-D", "-N", node, program="slurmd")
        self.wait_for(lambda: self.say("sinfo", "-h", "-o", "%t %D").split() == ["idle", "2"])

    def _write_configuration(self) -> None:
        host = socket.gethostname().partition(".")[0]
        lines = [
            f"NodeName={node} NodeHostname={host} NodeAddr=127.0.0.1 Port={free_port('127.0.0.1')} CPUs=1 "
            "RealMemory=4000 State=UNKNOWN"
            for node in NODES
        ]
        user = subprocess.check_output(["id", "-un"], text=True).strip()
        text = CONF.format(
            host=host, port=free_port("127.0.0.1"), user=user, folder=self.folder, nodes="\n".join(lines)
        )
        (self.folder / "slurm.conf").write_text(text)

    def _write_srun(self) -> None:
        """Let jobs find the cluster: Snakemake's plugin takes away all variables of SLURM before it submits them."""
        srun = self.folder / "bin" / "srun"
        srun.parent.mkdir()
        conf = self.environment["SLURM_CONF"]
        srun.write_text(f'#!/bin/sh\nSLURM_CONF={conf} exec {shutil.which("srun")} "$@"\n')
        srun.chmod(0o755)

    def _run(self, name: str, *arguments: str, program: str | None = None) -> None:
        with (self.folder / f"{name}.log").open("wb") as log:
            self._processes[name] = subprocess.Popen(
                [program or name, *arguments], env=self.environment, stdout=log, stderr=log, start_new_session=True
            )

    def say(self, *command: str) -> str:
        """Return what one of SLURM's commands prints; nothing while the controller does not answer."""
        return subprocess.run(command, env=self.environment, capture_output=True, text=True, check=False).stdout

    def wait_for(self, condition, limit_s: float = 60.0) -> None:
        """Wait until something is so."""
        deadline = time.monotonic() + limit_s
        while not condition():
            logs = "\n".join(path.read_text(errors="replace")[-1500:] for path in self.folder.glob("*.log"))
            assert time.monotonic() < deadline, logs
            time.sleep(0.5)

    def jobs_on(self, node: str) -> list[str]:
        """Return the jobs that run on a node."""
        return self.say("squeue", "-h", "-w", node, "-t", "RUNNING", "-o", "%i").split()

    def restarts_of(self, job: str) -> int:
        """Return how often a job was put back and begun again."""
        return int(re.findall(r"Restarts=(\d+)", self.say("scontrol", "show", "job", job))[0])

    def commands_on(self, node: str) -> list[str]:
        """Return the command lines of what runs on a node."""
        return [_command(pid) for pid in self._started_for(node)]

    def pull_the_plug(self, node: str) -> None:
        """Kill a node at once, with everything that runs on it."""
        daemon = self._processes.pop(node)
        own = self._started_for(node)
        parents = _parents()
        steps = {parents[pid] for pid in own if pid in parents and _name(parents[pid]) == "slurmstepd"}
        daemon.kill()
        for pid in own | steps:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        daemon.wait()

    def _started_for(self, node: str) -> set[int]:
        """Return the processes of a node's jobs: their environment names this cluster and the node."""
        marks = {f"SLURMD_NODENAME={node}".encode(), f"SLURM_CONF={self.folder}/slurm.conf".encode()}
        own = set()
        for environ in Path("/proc").glob("[0-9]*/environ"):
            with suppress(OSError):  # it ended meanwhile, or is somebody else's
                if marks <= set(environ.read_bytes().split(b"\0")):
                    own.add(int(environ.parent.name))
        return own

    def stop(self) -> None:
        """End everything that was started, and what is left of it."""
        for node in NODES:
            if node in self._processes:
                self.pull_the_plug(node)
        for process in reversed(self._processes.values()):
            process.terminate()
            try:
                process.wait(timeout=30.0)
            except subprocess.TimeoutExpired:
                process.kill()
        self._processes.clear()


def _parents() -> dict[int, int]:
    """Return the parent of every process."""
    parents = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            parents[int(stat.parent.name)] = int(stat.read_text().rpartition(")")[2].split()[1])
        except (FileNotFoundError, ProcessLookupError):
            continue  # it ended meanwhile
    return parents


def _name(pid: int) -> str:
    with suppress(OSError):
        return Path(f"/proc/{pid}/comm").read_text().strip()
    return ""


def _command(pid: int) -> str:
    with suppress(OSError):
        return Path(f"/proc/{pid}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    return ""
