"""Run every command of the README, with the numbers made small, one after the other in an empty folder."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()

# What makes a command quick without making it another command.
SMALLER = {
    "--scenes": "1",
    "--stages": "0",
    "--steps": "3",
    "--save_freq": "3",
    "--batch_size": "2",
    "--eval.n_episodes": "1",
    "--dataset.num_episodes": "1",
    "--dataset.episode_time_s": "2",
}
EXTRA = {"lerobot-eval --policy": ["--env.episode_length=5"]}


def commands():
    blocks = re.findall(r"```bash\n(.*?)```", README, flags=re.DOTALL)
    text = "\n".join(blocks).replace("\\\n", " ")
    return [line for line in map(str.strip, text.splitlines()) if line and not line.startswith("#")]


def made_small(command):
    words = shlex.split(command, comments=True)
    for i, word in enumerate(words):
        option = word.split("=")[0]
        if option in SMALLER:
            words[i] = f"{option}={SMALLER[option]}"
    for start, extra in EXTRA.items():
        if command.startswith(start):
            words += extra
    return words


def test_make_targets_of_the_readme_exist():
    makefile = (ROOT / "Makefile").read_text()
    targets = re.findall(r"^make ([a-z0-9-]+)|`make ([a-z0-9-]+)`", README, flags=re.MULTILINE)
    targets = [named or quoted for named, quoted in targets]
    assert {"demo", "test"} <= set(targets)
    for target in targets:
        assert re.search(rf"^{target}:", makefile, flags=re.MULTILINE), target


def test_the_python_example_runs_as_it_stands():
    (example,) = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
    assert len([line for line in example.splitlines() if line.strip()]) <= 10
    shown = subprocess.run([sys.executable, "-c", example], capture_output=True, text=True, check=True).stdout
    assert shown.startswith("(96, 128, 3) [")


def test_readme_has_no_gaps():
    assert "PLACEHOLDER" not in README


def test_links_of_the_readme_lead_somewhere():
    for link in re.findall(r"\]\(([^)#]+)\)", README):
        assert (ROOT / link).exists(), link


@pytest.mark.slow
def test_every_command_of_the_readme_runs(tmp_path):
    environment = {
        **os.environ,
        "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}",
        "HF_HOME": str(tmp_path / "hf"),
        "HF_LEROBOT_HOME": str(tmp_path / "lerobot"),
        "HF_HUB_OFFLINE": "1",
        "MUJOCO_GL": os.environ.get("MUJOCO_GL", "egl"),
    }
    ran = []
    for command in commands():
        if command.startswith(("make ", "source ", "pip ")):
            continue
        words = made_small(command)
        if words[0] == "export":
            environment.update(word.split("=", maxsplit=1) for word in words[1:])
            continue
        done = subprocess.run(
            words, cwd=tmp_path, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True
        )
        assert done.returncode == 0, f"{shlex.join(words)}\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}"
        ran.append(words[0])
    assert {"lerobot-excav", "lerobot-train", "lerobot-eval", "lerobot-record", "lerobot-replay"} <= set(ran)
    assert list((tmp_path / "outputs/eval").rglob("*.mp4"))
    assert (tmp_path / "outputs/report/report.md").read_text().count("target") > 0
