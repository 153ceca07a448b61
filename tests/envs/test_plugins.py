from types import SimpleNamespace

import pytest

from lerobot_excav.envs import plugins
from lerobot_excav.errors import ConfigurationError


def test_a_package_that_cannot_be_loaded_is_named(monkeypatch):
    def load():
        raise ModuleNotFoundError("No module named 'nonexistent'")

    broken = SimpleNamespace(name="mine", value="my_tasks", dist=SimpleNamespace(name="my-package"), load=load)
    monkeypatch.setattr(plugins, "entry_points", lambda group: [broken])
    plugins.load_plugins.cache_clear()
    try:
        with pytest.raises(
            ConfigurationError, match=r"mine=my_tasks of my-package .*nonexistent.* uninstall my-package"
        ):
            plugins.load_plugins()
    finally:
        monkeypatch.undo()
        plugins.load_plugins.cache_clear()
        plugins.load_plugins()
