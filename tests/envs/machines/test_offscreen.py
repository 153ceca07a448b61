import sys

import pytest

from lerobot_excav.envs.machines import offscreen
from lerobot_excav.errors import RenderingError


@pytest.fixture
def environment(monkeypatch):
    for name in ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    return monkeypatch


def test_linux_without_a_display_draws_with_egl(environment):
    assert offscreen.default_backend() == "egl"


@pytest.mark.parametrize("variable", ["DISPLAY", "WAYLAND_DISPLAY"])
def test_linux_with_a_display_uses_it(environment, variable):
    environment.setenv(variable, ":0")
    assert offscreen.default_backend() == "glfw"


def test_other_systems_use_their_window_system(environment):
    environment.setattr(sys, "platform", "darwin")
    assert offscreen.default_backend() == "glfw"


@pytest.mark.parametrize("backend", ["egl", "osmesa", "glfw"])
def test_the_user_decides(environment, backend):
    environment.setenv("MUJOCO_GL", backend)
    assert offscreen.default_backend() == backend


def test_failure_says_what_to_install(environment):
    def broken(backend):
        raise OSError("no driver")

    environment.setattr(offscreen, "_context_class", broken)
    with pytest.raises(RenderingError, match=r"(?s)no driver.*libegl1.*osmesa"):
        offscreen.create_context(32, 32)
