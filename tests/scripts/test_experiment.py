import os
import signal
import subprocess
import sys
import time

import pytest

from lerobot_excav.scripts.main import main


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "stages.toml"
    path.write_text(f"""
[settings]
out = "{tmp_path}"
colour = "red"

[environment]
SIZE = "3 cm"

[[stage]]
name = "paint"
makes = "{{out}}/paint"
command = "mkdir {{makes}} && touch {{makes}}/{{colour}}"

[[stage]]
name = "bad"
needs = ["paint"]
makes = "{{out}}/bad"
command = "false"
""")
    return path


def test_an_experiment_runs_and_says_whether_it_succeeded(file, tmp_path, capsys):
    assert main(["experiment", str(file)]) == 1
    assert (tmp_path / "paint" / "red").exists()
    assert "bad: FAILED" in capsys.readouterr().out
    assert main(["experiment", str(file), "--only", "paint"]) == 0


def test_the_list_tells_how_far_the_stages_are(file, capsys):
    main(["experiment", str(file), "--only", "paint"])
    capsys.readouterr()
    assert main(["experiment", str(file), "--list"]) == 0
    first, second = capsys.readouterr().out.splitlines()
    assert first.startswith("finished")
    assert "min" in first
    assert second.startswith("to do")


def test_a_dry_run_prints_a_script_and_runs_nothing(file, tmp_path, capsys):
    assert main(["experiment", str(file), "--dry-run", "--only", "paint"]) == 0
    script = capsys.readouterr().out
    assert "export SIZE='3 cm'" in script
    assert f"mv {tmp_path}/paint.partial {tmp_path}/paint" in script
    assert not (tmp_path / "paint").exists()


def test_a_setting_can_be_replaced(file, tmp_path):
    assert main(["experiment", str(file), "--only", "paint", "--set", "colour=blue"]) == 0
    assert (tmp_path / "paint" / "blue").exists()


@pytest.mark.parametrize(
    ("option", "message"), [(["--set", "colour"], "NAME=VALUE"), (["--jobs=0"], "--jobs=0")]
)
def test_options_that_cannot_be_used_are_named(file, capsys, option, message):
    assert main(["experiment", str(file), *option]) == 2
    assert message in capsys.readouterr().err


def test_a_closed_terminal_ends_the_stages(tmp_path):
    path = tmp_path / "stages.toml"
    path.write_text(
        f'[[stage]]\nname = "long"\nmakes = "{tmp_path}/long"\ncommand = "sleep 1; touch {tmp_path}/begun; sleep 60"'
    )
    # A test run in the background may ignore the signal, and what ignores it passes that on.
    heed = "import signal; signal.signal(signal.SIGHUP, signal.SIG_DFL)"
    code = f"{heed}; from lerobot_excav.scripts.main import main; raise SystemExit(main())"
    runner = subprocess.Popen([sys.executable, "-c", code, "experiment", str(path)])
    while not (tmp_path / "begun").exists():
        time.sleep(0.05)
    os.kill(runner.pid, signal.SIGHUP)
    assert runner.wait(30) == 130
    assert '"exit_code": -15' in (tmp_path / "long.json").read_text()
