import os
import subprocess
import sys
import threading

import mujoco
import pytest

from lerobot_excav.envs.machines import offscreen, opengl_backend
from lerobot_excav.envs.machines.camera_pictures import CameraPictures, visible_groups
from lerobot_excav.errors import RenderingError

MODEL = """
<mujoco>
  <visual><quality offsamples="0"/></visual>
  <worldbody><geom size="0.2" rgba="1 0 0 1"/><camera name="eye" pos="0 0 1"/></worldbody>
</mujoco>
"""
# A process of its own, because a context fixes the backend of PyOpenGL and a fork spoils it.
START = f"""
import os, sys
import mujoco
from lerobot_excav.envs.machines.camera_pictures import CameraPictures, visible_groups
model = mujoco.MjModel.from_xml_string('''{MODEL}''')
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)
def pictures():
    return CameraPictures(model, data, cameras=("eye",), height=8, width=8, max_geoms=9)
def draw(pictures):
    return pictures.colour("eye", visible_groups(0))[4, 4].argmax()
"""


def run(code, **variables):
    """Run a program; return what it printed, and how its error ends if it has one."""
    names = ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY", "PYOPENGL_PLATFORM")
    environment = {key: value for key, value in os.environ.items() if key not in names} | variables
    command = [sys.executable, "-c", START + code]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=False)
    return done.stdout + done.stderr.strip().rpartition("\n")[2] * (done.returncode != 0)


@pytest.fixture
def pictures():
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    pictures = CameraPictures(model, data, cameras=("eye",), height=8, width=8, max_geoms=9)
    yield pictures
    pictures.close()


def draw(pictures):
    return pictures.colour("eye", visible_groups(0))[4, 4].argmax()


HEADLESS = ("egl", "osmesa")


@pytest.mark.parametrize(
    ("platform", "variables", "tried"),
    [
        ("linux", {}, HEADLESS),
        ("linux", {"MUJOCO_GL": "on"}, HEADLESS),
        ("linux", {"DISPLAY": ":0"}, ("glfw", *HEADLESS)),
        ("linux", {"WAYLAND_DISPLAY": ":0"}, ("glfw", *HEADLESS)),
        ("darwin", {}, ("glfw",)),
        ("win32", {"MUJOCO_GL": "wgl"}, ("glfw",)),
        *(("linux", {"MUJOCO_GL": choice, "DISPLAY": ":0"}, (choice,)) for choice in ("egl", "osmesa", "glfw")),
    ],
)
def test_the_user_decides_else_a_display_is_tried_before_egl_and_osmesa(monkeypatch, platform, variables, tried):
    for name in ("MUJOCO_GL", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", platform)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert opengl_backend.backends() == tried


def test_pictures_that_are_switched_off_are_not_drawn(monkeypatch, pictures):
    monkeypatch.setenv("MUJOCO_GL", "disabled")
    with pytest.raises(RenderingError, match="MUJOCO_GL=disabled switches pictures off"):
        draw(pictures)


def test_failure_names_every_backend_and_says_what_to_install(monkeypatch, pictures):
    def broken(backend, *_):
        raise OSError(f"no driver for {backend}")

    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setattr(offscreen, "make_context", broken)
    with pytest.raises(RenderingError, match=r"(?s)no driver for egl.*no driver for osmesa.*libegl1.*MUJOCO_GL=osmesa"):
        draw(pictures)


@pytest.mark.slow
@pytest.mark.parametrize("variable", ["DISPLAY", "WAYLAND_DISPLAY"])
def test_without_a_server_for_the_display_egl_draws(variable):
    assert run("print(draw(pictures()))", **{variable: ":77"}) == "0\n"


def test_a_display_that_was_asked_for_and_does_not_answer_is_named():
    text = run("draw(pictures())", MUJOCO_GL="glfw", DISPLAY=":77")
    assert "RenderingError: MUJOCO_GL=glfw cannot make an OpenGL context here" in text
    assert "Failed to open display :77" in text
    assert "set MUJOCO_GL=egl" in text


@pytest.mark.parametrize(("asked", "reason"), [("nonsense", "invalid value"), ("egl", "no library")])
def test_a_backend_with_which_mujoco_cannot_be_imported_is_named(tmp_path, asked, reason):
    (tmp_path / "OpenGL").mkdir()
    (tmp_path / "OpenGL" / "__init__.py").write_text("raise AttributeError('no library')")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import lerobot_excav.envs.machines.simulator"
    environment = os.environ | {"MUJOCO_GL": asked}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert f"RenderingError: MuJoCo cannot be imported with MUJOCO_GL={asked}: {reason}" in done.stderr
    assert "Unset MUJOCO_GL" in done.stderr


def test_threads_may_draw_one_after_the_other(pictures):
    seen = [draw(pictures)]
    thread = threading.Thread(target=lambda: seen.append(draw(pictures)))
    thread.start()
    thread.join()
    assert [*seen, draw(pictures)] == [0, 0, 0]


def test_a_second_thread_is_told_that_another_one_is_drawing(pictures):
    caught = []

    def intrude():
        try:
            draw(pictures)
        except RenderingError as error:
            caught.append(str(error))

    draw(pictures)
    with pictures._context.bound():
        thread = threading.Thread(target=intrude)
        thread.start()
        thread.join()
    assert caught == ["these pictures are being drawn by another thread; give each thread an environment of its own"]
    assert draw(pictures) == 0


# The first picture, and perhaps more, is drawn before the fork; `same` is what the parent drew, `after` is new.
FORK = """
same, after = pictures(), pictures()
draw(same)
{before}
child = os.fork()
try:
    {inside}
except Exception as error:
    print(type(error).__name__, error, flush=True)
if child:
    os.waitpid(child, 0)
    print(draw(pictures()))
"""


@pytest.mark.parametrize("before", ["", "same.close()"], ids=["open", "closed"])
@pytest.mark.parametrize("drawn", ["same", "after"])
def test_a_fork_after_a_picture_is_refused_in_the_child_and_harms_neither(before, drawn):
    if drawn == "same" and before:
        return
    text = run(FORK.format(before=before, inside=f"child or draw({drawn})"), MUJOCO_GL="egl")
    error, result = text.splitlines()
    assert error.startswith("RenderingError process ")
    assert '"context": "forkserver"' in error
    assert result == "0"


@pytest.mark.parametrize("end", ["same.close()", "globals().pop('same')"], ids=["close", "forget"])
def test_a_forked_process_ends_after_it_has_closed_what_it_inherited(end):
    assert run(FORK.format(before="", inside=f"child or {end}"), MUJOCO_GL="egl") == "0\n"


def test_a_fork_before_the_first_picture_draws():
    code = "child = os.fork(); print(draw(pictures()), flush=True); child and os.waitpid(child, 0)"
    assert run(code, MUJOCO_GL="egl") == "0\n0\n"
