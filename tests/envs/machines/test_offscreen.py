import sys

import pytest

from lerobot_excav.envs.machines import offscreen
from lerobot_excav.errors import RenderingError


@pytest.mark.parametrize(
    ("platform", "variables", "backend"),
    [
        ("linux", {}, "egl"),
        ("linux", {"DISPLAY": ":0"}, "glfw"),
        ("linux", {"WAYLAND_DISPLAY": ":0"}, "glfw"),
        ("darwin", {}, "glfw"),
        *(("linux", {"MUJOCO_GL": choice}, choice) for choice in ("egl", "osmesa", "glfw")),
    ],
)
def test_the_user_decides_else_egl_is_taken_on_linux_without_a_display(monkeypatch, platform, variables, backend):
    for name in ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", platform)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert offscreen.default_backend() == backend


def test_failure_says_what_to_install(monkeypatch):
    def broken(backend):
        raise OSError("no driver")

    monkeypatch.setattr(offscreen, "_context_class", broken)
    with pytest.raises(RenderingError, match=r"(?s)no driver.*libegl1.*osmesa"):
        offscreen.create_context(32, 32)
