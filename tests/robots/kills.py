"""A real `lerobot-record`, killed at a random moment and recovered."""

import json
import os
import random
import re
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lerobot.datasets.lerobot_dataset import LeRobotDataset

from lerobot_excav.scripts import main

SIZE = (48, 64)
EPISODES = 4
PATIENCE_S = 600.0
# Frames per second, and how long an episode lasts [s].
ROBOTS = {"fr5_sim": (50, 0.4), "excavator_sim": (10, 0.8)}

SERVER = """
import json, os, sys
import lerobot_excav.plugin
from lerobot.scripts import lerobot_record  # nothing is drawn here: a graphics context does not survive a fork

for line in sys.stdin:
    job = json.loads(line)
    pid = os.fork()
    if pid == 0:
        output = os.open(job["output"], os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(output, 1)
        os.dup2(output, 2)
        sys.argv = job["argv"]
        lerobot_record.main()
        os._exit(0)
    print(pid, flush=True)
    print(os.waitpid(pid, 0)[1], flush=True)
"""


class RecordServer:
    """Starts `lerobot-record` in forks of one process, which has imported LeRobot already."""

    def __init__(self):
        self._process = subprocess.Popen(
            [sys.executable, "-c", SERVER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def start(self, arguments, output):
        """Start a recording; return the number of its process."""
        job = {"argv": ["lerobot-record", *arguments], "output": str(output)}
        self._process.stdin.write(json.dumps(job) + "\n")
        self._process.stdin.flush()
        return int(self._process.stdout.readline())

    def wait(self):
        """Wait for the end of the recording; return its status."""
        return int(self._process.stdout.readline())

    def stop(self):
        self._process.stdin.close()
        self._process.wait()


@contextmanager
def record_server():
    server = RecordServer()
    try:
        yield server
    finally:
        server.stop()


@dataclass(kw_only=True)
class Kill:
    """What a kill left.

    Attributes:
        robot_type: Robot.
        announced: Number of the episode that LeRobot announced last, which was in hand; -1 if there was none.
        was_running: Whether the kill came before the recording was over.
        recovered: How many episodes were recovered; None if there was nothing to recover.
        moment: When it came, in words.
    """

    robot_type: str
    announced: int
    was_running: bool
    recovered: int | None
    moment: str


def events_of(log):
    """Return the events of a session log that are whole, read without the package."""
    events = []
    for line in log.read_text().split("\n") if log.exists() else []:
        try:
            events.append(json.loads(line))
        except ValueError:
            continue
    return events


def frames_of(log):
    """Return the states and actions by episode, of the last time that each was recorded."""
    frames = {}
    for event in events_of(log):
        if event["event"] == "episode":
            number = event["episode_index"]
            frames = {index: kept for index, kept in frames.items() if index < number} | {number: []}
        elif event["event"] == "action":
            frames[number].append((event["state"], event["action"]))
    return frames


def kill_recording(server, folder, robot_type, draw, *, resume=False):
    """Record into `folder`, and kill the recording at a random moment; return what LeRobot announced last."""
    fps, seconds = ROBOTS[robot_type]
    output = folder / "output.txt"
    log = folder / "session.jsonl"
    begins = sum(event["event"] == "episode" for event in events_of(log))
    arguments = [
        f"--robot.type={robot_type}",
        f"--robot.session_log={log}",
        f"--robot.calibration_dir={folder}",
        f"--robot.observation_height={SIZE[0]}",
        f"--robot.observation_width={SIZE[1]}",
        f"--teleop.type={robot_type.replace('sim', 'operator')}",
        f"--teleop.calibration_dir={folder}",
        "--dataset.repo_id=someone/data",
        f"--dataset.root={folder / 'data'}",
        f"--dataset.fps={fps}",
        f"--dataset.num_episodes={EPISODES}",
        "--dataset.single_task=go",
        f"--dataset.episode_time_s={seconds}",
        "--dataset.reset_time_s=0.1",
        "--dataset.video=false",
        "--dataset.push_to_hub=false",
        "--dataset.no_stamp=true",
        "--play_sounds=false",
        f"--resume={str(resume).lower()}",
    ]
    episode, actions, delay_s = draw.randrange(EPISODES), draw.randint(0, 6), draw.uniform(0.0, 1.2)
    pid = server.start(arguments, output)
    deadline = time.monotonic() + PATIENCE_S
    is_there = False
    while not is_there and time.monotonic() < deadline and Path(f"/proc/{pid}").exists():
        events = events_of(log)
        starts = [i for i, event in enumerate(events) if event["event"] == "episode"][begins:]
        is_there = len(starts) > episode and len(events) - starts[episode] > actions
        time.sleep(0.005)
    time.sleep(delay_s)
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)
    status = server.wait()
    announced = [int(number) for number in re.findall(r"Recording episode (\d+)", output.read_text())]
    moment = f"episode {episode}, {actions} actions, {delay_s:.2f} s later"
    return (announced[-1] if announced else -1), status == signal.SIGKILL, moment


def run(*arguments):
    return main.main(list(map(str, arguments)))


def assert_equal_to_log(folder):
    """Open the dataset, decode every picture, and compare every state and action with the log; return its length."""
    dataset = LeRobotDataset("someone/data", root=folder / "data")
    found = {}
    for row in (dataset[i] for i in range(len(dataset))):
        frames = found.setdefault(int(row["episode_index"]), [])
        frames.append((row["observation.state"].numpy(), row["action"].numpy()))
        pictures = [row[key] for key in row if key.startswith("observation.images.")]
        assert len(pictures) == 3
        assert all(picture.shape == (3, *SIZE) and picture.max() > 0.0 for picture in pictures)
    noted = frames_of(folder / "session.jsonl")
    for index, frames in found.items():
        for place in (0, 1):
            expected = np.array([frame[place] for frame in noted[index]], np.float32)
            assert np.array_equal(np.stack([frame[place] for frame in frames]), expected), index
    assert list(found) == list(range(dataset.num_episodes))
    return dataset.num_episodes


def kill_and_recover(server, folder, seed, robot_type):
    """Kill a recording, recover, sometimes resume and kill and recover again, then complete and check it."""
    draw = random.Random(seed)
    kills, before = [], 0
    for resume in [False, True][: 1 + (draw.random() < 0.3)]:
        announced, was_running, moment = kill_recording(server, folder, robot_type, draw, resume=resume)
        code = run("index", folder / "data", f"--session={folder / 'session.jsonl'}", "--recover")
        recovered = assert_equal_to_log(folder) if code == 0 else None
        kills.append(
            Kill(
                robot_type=robot_type,
                announced=announced,
                was_running=was_running,
                recovered=recovered,
                moment=moment,
            )
        )
        # At most the episode in hand is lost; a recording that came to its end loses nothing.
        assert max(before, announced + (not was_running)) <= (recovered or 0) <= announced + 1, kills
        if recovered is None:
            return kills
        before = recovered
    assert run("index", folder / "data", f"--session={folder / 'session.jsonl'}") == 0, kills
    assert run("qc", folder / "data", "--replays=1") == 0, kills
    return kills
