"""The wheel carries the name by which LeRobot finds the plugin."""

import subprocess
import sys
import zipfile
from email.parser import Parser
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Build without isolation, so without a network."""
    out = tmp_path_factory.mktemp("dist")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(out), str(ROOT)]
    subprocess.run(command, check=True, capture_output=True)
    return zipfile.ZipFile(next(out.glob("*.whl")))


def read(wheel, ending):
    return wheel.read(next(name for name in wheel.namelist() if name.endswith(ending))).decode()


def test_the_distribution_keeps_its_underscores(wheel):
    # LeRobot imports the module called exactly like the distribution; a hyphen would hide the plugin.
    assert Parser().parsestr(read(wheel, "METADATA"))["Name"] == "lerobot_env_excav"


def test_the_wheel_holds_every_file_of_both_packages_and_nothing_else(wheel):
    files = [path for path in ROOT.glob("lerobot_*excav/**/*") if path.is_file() and "__pycache__" not in path.parts]
    names = set(wheel.namelist())
    assert {path.relative_to(ROOT).as_posix() for path in files} <= names
    tops = {name.split("/")[0] for name in names}
    assert {top for top in tops if not top.endswith(".dist-info")} == {"lerobot_env_excav", "lerobot_excav"}


def test_the_command_is_installed(wheel):
    assert "lerobot-excav = lerobot_excav.scripts.main:main" in read(wheel, "entry_points.txt")
