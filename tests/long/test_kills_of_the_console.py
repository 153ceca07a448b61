"""`lerobot-excav console`, killed at any moment of a recording: at most the episode in hand is lost.

Not part of the default run. Every kill is a SIGKILL to the command; the same command then goes on, and in the end the
dataset is complete and passes the quality check.
"""

import os
import random

import pytest

from lerobot_excav.datasets.check.quality_check import check_dataset
from validation.page_operator.socket_page import ConsoleProcess, SocketPage

KILLS = int(os.environ.get("EXCAV_KILLS", "20"))
SCENES = 3
FLAGS = ("--env.type=excavator", "--env.fidelity=fast", f"--scenes={SCENES}", "--height=96", "--width=128")


def record(page, rng):
    """Record and keep an episode of a few frames; return how many are kept then."""
    swing = rng.choice((-1.0, 1.0))
    page.record(lambda _: [swing, 0.0, 0.0, 0.0], frames=3)
    return page.state["recording"]["kept"]


@pytest.mark.slow
def test_at_most_the_episode_in_hand_is_lost(tmp_path):
    out, rng, kept = tmp_path / "by_hand", random.Random(0), 0
    for kill in range(KILLS):
        console = ConsoleProcess(*FLAGS, f"--out={out}")
        page = SocketPage(console.address, drives=True)
        found = page.state["recording"]["kept"]
        assert kept <= found <= kept + 1, (
            f"{found} kept after kill {kill}, {kept} before"
        )  # it may have been kept at last
        kept = found
        if kept < 4 * SCENES and rng.random() < 0.5:
            kept = record(page, rng)
        if kept < 4 * SCENES:
            begin(page, rng.choice(("resetting", "running", "finished", "keeping")))
        else:
            page.wish("complete")
        console.kill()
        page.close()
        print(f"kill {kill + 1} of {KILLS}: {kept} kept", flush=True)
        if out.exists():
            break
    finish(out, rng)
    report = check_dataset(out, replays=4 * SCENES)
    assert report.has_passed, report
    assert len(report.episodes) == 4 * SCENES


def begin(page, last):
    """Begin an episode, and go on until some moment of it."""
    page.wish("record")
    if last == "resetting":
        return
    page.wait(lambda state: state["recording"]["running"] and state["ready"])
    page.axes = [1.0, 0.0, 0.0, 0.0]
    if last == "running":
        return
    page.wait(lambda state: state["recording"]["frames"] >= 3)
    page.wish("finish")
    if last == "keeping":
        page.wish("keep")


def finish(out, rng):
    """Let the same command record what is left, and write the dataset."""
    if out.exists():
        return
    console = ConsoleProcess(*FLAGS, f"--out={out}")
    page = SocketPage(console.address, drives=True)
    while page.state["recording"]["left"]:
        record(page, rng)
    page.wish("complete")
    page.wait(lambda state: state["recording"]["complete"])
    page.close()
    console.kill()
