"""Small datasets, one of every way to record: by script, by gamepad, on the page; of both machines."""

import math
import shutil
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from validation.page_operator.socket_page import ConsoleProcess, SocketPage

EXCAV = (sys.executable, "-c", "import sys; from lerobot_excav.scripts.main import main; sys.exit(main(sys.argv[1:]))")
EPISODES, SCENES, SECONDS = 4, 1, 11


def by_script(env_type: str, storage: str, out: Path) -> None:
    """Record with `lerobot-excav demos`."""
    flags = (f"--env.type={env_type}", f"--scenes={SCENES}", f"--storage={storage}", "--resume=true", f"--out={out}")
    _run(*EXCAV, "demos", *flags)


def by_gamepad(out: Path) -> None:
    """Record the excavator with `lerobot-record` and a simulated gamepad, and complete it."""
    log, raw = out.with_suffix(".session.jsonl"), out.with_suffix(".raw")
    shutil.rmtree(raw, ignore_errors=True)  # of a run that was interrupted
    log.unlink(missing_ok=True)
    record = (
        *("--robot.type=excavator_sim", f"--robot.session_log={log}", "--teleop.type=excavator_joystick"),
        *(
            f"--dataset.repo_id=local/{out.name}",
            f"--dataset.root={raw}",
            "--dataset.single_task=Dig.",
            "--dataset.fps=10",
        ),
        *(f"--dataset.num_episodes={EPISODES}", f"--dataset.episode_time_s={SECONDS}", "--dataset.reset_time_s=0"),
        *("--dataset.video=false", "--dataset.push_to_hub=false", "--dataset.no_stamp=true", "--play_sounds=false"),
    )
    _run(sys.executable, "-m", "validation.judges.pad_recorder", *record)
    _run(*EXCAV, "index", str(raw), f"--session={log}", f"--out={out}")


def on_the_page(env_type: str, out: Path) -> None:
    """Record with `lerobot-excav console` and sticks that go to and fro."""
    flags = (f"--env.type={env_type}", f"--scenes={SCENES}", f"--out={out}")
    with ConsoleProcess(*flags) as console:
        page = SocketPage(console.address, drives=True)
        fps = page.state["fps"]

        for episode in range(EPISODES):
            page.record(partial(_sticks, episode=episode, fps=fps), frames=SECONDS * fps)
        page.wish("complete")
        page.wait(lambda state: state["recording"]["complete"])
        page.close()


def _sticks(frame: int, *, episode: int, fps: int) -> list[float]:
    """Return where sticks are that go to and fro, another way in every episode.

    They are out of the dead zone from the first moment on, for time stands still until somebody moves.
    """
    phase = 0.3 + 0.7 * episode
    return [0.5 * math.sin(phase + 2.0 * math.pi * frame / fps / period_s) for period_s in (4.0, 5.0, 3.0, 6.0)]


RECORDINGS: dict[str, Callable[[Path], None]] = {
    "excavator_script": partial(by_script, "excavator", "video"),
    "excavator_script_pictures": partial(by_script, "excavator", "image"),
    "excavator_gamepad": by_gamepad,
    "excavator_page": partial(on_the_page, "excavator"),
    "fr5_script": partial(by_script, "fr5_grasp", "video"),
    "fr5_script_pictures": partial(by_script, "fr5_grasp", "image"),
    "fr5_page": partial(on_the_page, "fr5_grasp"),
}


def record_missing(folder: Path, say: Callable[[str], None]) -> dict[str, Path]:
    """Record the datasets that are not there yet; return them all by name."""
    folder.mkdir(parents=True, exist_ok=True)
    datasets = {name: folder / name for name in RECORDINGS}
    for name, path in datasets.items():
        if not path.exists():
            say(f"recording {name} ...")
            RECORDINGS[name](path)
    return datasets


def _run(*command: str) -> None:
    done = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command[3:])} ended with {done.returncode}: {done.stderr[-2000:]}")
