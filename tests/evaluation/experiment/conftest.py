"""Experiments of commands that take no time."""

import pytest

from lerobot_excav.evaluation.experiment.experiment import read_experiment


@pytest.fixture
def experiment(tmp_path):
    """Write a TOML file and read it; `{tmp}` in it is a folder of the test's own."""

    def make(text, **settings):
        path = tmp_path / "stages.toml"
        path.write_text(f'[settings]\ntmp = "{tmp_path}"\n{text}')
        return read_experiment(path, settings)

    return make
