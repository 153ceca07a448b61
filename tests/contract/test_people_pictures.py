"""What every environment of this package shows people, whatever its robot and task."""

from itertools import pairwise

import gymnasium as gym
import numpy as np
import pytest

from lerobot_excav.envs.tasks.caption import bar_height_px
from lerobot_excav.envs.tasks.registry import TASKS
from lerobot_excav.errors import ConfigurationError

pytestmark = pytest.mark.slow

SPECS = sorted((s for s in TASKS.values() if s.env_entry.startswith("lerobot_excav.")), key=lambda spec: spec.id)
SMALL = {"render_height": 96, "render_width": 128}


@pytest.fixture(scope="module", params=SPECS, ids=lambda spec: spec.id)
def spec(request):
    return request.param


@pytest.fixture(scope="module")
def make(spec):
    """Make environments that are closed at the end."""
    made = []

    def _make(**settings):
        env = gym.make(spec.gym_id, disable_env_checker=True, **{**SMALL, **settings}).unwrapped
        made.append(env)
        return env

    yield _make
    for env in made:
        env.close()


@pytest.fixture(scope="module")
def env(make):
    return make()


def start(env, target_id=0):
    env.reset(options={"scene_id": 4, "target_id": target_id})
    return env


def middle(env):
    space = env.action_space
    return (0.5 * (space.high + space.low)).astype(np.float32)


def foot(env):
    """The rows that a caption covers."""
    return np.s_[-bar_height_px(env.render_settings.render_height) :]


def scene(env):
    """The rows above it."""
    return np.s_[: -bar_height_px(env.render_settings.render_height)]


def test_a_picture_is_480_by_640_unless_asked_otherwise(spec):
    env = start(gym.make(spec.gym_id, disable_env_checker=True).unwrapped)
    picture = env.render()
    assert (picture.shape, picture.dtype) == ((480, 640, 3), np.uint8)
    env.close()


@pytest.mark.parametrize(("height", "width"), [(96, 128), (100, 240)])
def test_height_and_width_are_those_asked_for(make, height, width):
    env = start(make(render_height=height, render_width=width))
    assert env.render().shape == (height, width, 3)
    assert env.observation_space["pixels"]["main"].shape == (96, 128, 3)


def test_every_camera_of_the_task_shows_another_picture(spec, make):
    assert spec.views[0] == "overview"
    pictures = {start(make(render_camera=camera)).render().tobytes() for camera in spec.views}
    assert len(pictures) == len(spec.views)


def test_the_overview_is_what_is_shown_unless_asked_otherwise(env, make):
    assert np.array_equal(start(env).render(), start(make(render_camera="overview")).render())


def test_another_camera_is_refused_and_those_there_are_named(spec):
    with pytest.raises(ConfigurationError, match=r"render_camera='behind' .*'overview'"):
        gym.make(spec.gym_id, render_camera="behind")


def test_people_see_another_picture_than_policies_also_with_the_same_camera_and_size(env, make):
    for shown in (env, make(render_camera="main")):
        start(shown)
        main = shown.picture()
        picture = shown.render()
        assert picture.shape == main.shape
        assert (picture != main).any(axis=-1)[scene(shown)].mean() > 0.5


def test_the_same_state_gives_the_same_picture_also_in_a_fresh_environment(env, make):
    first = start(env).render()
    env.render()[...] = 0
    assert np.array_equal(env.render(), first)
    assert np.array_equal(start(make()).render(), first)


def test_whether_people_watch_changes_nothing_that_is_observed(make):
    traces = []
    for is_watched in (False, True):
        env, rng = make(), np.random.default_rng(2)
        observation, info = start(env), None
        observation, info = env.reset(options={"scene_id": 4, "target_id": 1})
        trace = []
        for _ in range(6):
            if is_watched:
                env.render()
            parts = {**observation["pixels"], "agent_pos": observation["agent_pos"], "state": info["task_state"]}
            trace.append({name: part.copy() for name, part in parts.items()})
            action = rng.uniform(-1.0, 1.0, env.action_space.shape).astype(np.float32)
            observation, reward, *_, info = env.step(action)
            trace[-1]["reward"] = np.array(reward)
        traces.append(trace)
    for alone, watched in zip(*traces, strict=True):
        for name, part in alone.items():
            assert np.array_equal(part, watched[name]), name


def test_every_third_frame_is_drawn_and_the_end_if_asked_so(make):
    env = start(make(render_every=3, episode_length=8))
    pictures = [env.render()]
    for _ in range(8):
        env.step(env.action_space.high)
        pictures.append(env.render())
    shown = [picture.tobytes() for picture in pictures]
    assert [a == b for a, b in pairwise(shown)] == [True, True, False, True, True, False, True, False]


def test_a_new_episode_is_drawn_at_once(make):
    env = start(make(render_every=100))
    first = env.render()
    env.reset(options={"scene_id": 5, "target_id": 0})
    assert not np.array_equal(env.render(), first)


def test_nothing_is_made_for_people_before_they_look(make):
    env = start(make())
    env.step(middle(env))
    assert env._view is None
    env.render()
    assert env._view is not None
    env.close()
    assert env._view is None


def test_gymnasium_shows_every_step_in_a_window(spec, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    pygame = pytest.importorskip("pygame")
    window = gym.make(spec.gym_id, render_mode="human", disable_env_checker=True, **SMALL)
    window.reset(options={"scene_id": 0, "target_id": 0})
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
    assert np.array_equal(shown, window.unwrapped.render())
    window.step(window.unwrapped.holding_action())
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
    assert np.array_equal(shown, window.unwrapped.render())
    window.close()


def test_without_a_render_mode_there_is_no_picture(make):
    assert start(make(render_mode=None)).render() is None


def test_without_pictures_for_policies_people_still_see_theirs(env, make):
    picture = start(make(obs_type="agent_pos")).render()
    assert np.array_equal(picture, start(env).render())


def test_the_commanded_target_is_marked(env):
    pictures = [start(env, target).render()[scene(env)] for target in range(4)]
    for i, picture in enumerate(pictures):
        for other in pictures[i + 1 :]:
            assert 8 < (picture != other).any(axis=-1).sum() < 0.1 * picture[..., 0].size


def test_another_target_that_the_mask_shows_is_marked_besides(env, make):
    right, wrong = start(env).render(), start(make(mask_condition="mismatched")).render()
    assert 4 < (right != wrong).any(axis=-1)[scene(env)].sum() < 0.1 * right[..., 0].size
    for condition in ("zero", "random"):
        other = start(make(mask_condition=condition)).render()
        assert np.array_equal(right[scene(env)], other[scene(env)])


def test_the_caption_says_what_is_wrong_with_the_mask(make):
    wide = {"render_width": 480}
    right = start(make(**wide))
    plain = right.render()[foot(right)]
    for settings in ({"mask_condition": "zero"}, {"mask_noise": "dilate", "mask_noise_px": 1}):
        assert not np.array_equal(start(make(**wide, **settings)).render()[foot(right)], plain)


def test_the_caption_tells_the_time(make):
    env = start(make(render_width=480))
    feet = []
    for _ in range(2):
        feet.append(env.render()[foot(env)].tobytes())
        for _ in range(round(0.2 * env.fps)):
            env.step(middle(env))
    assert feet[0] != feet[1]


@pytest.mark.parametrize("is_success", [True, False])
def test_the_caption_tells_the_outcome_once_it_is_decided(make, monkeypatch, is_success):
    env = start(make(episode_length=2, render_width=480))
    monkeypatch.setattr(type(env), "is_success", property(lambda self: is_success))
    for is_over in (False, True):
        *_, truncated, _ = env.step(middle(env))
        assert truncated == is_over
        caption = env.caption
        assert (caption.outcome is not None) == is_over
        assert caption.is_success == (is_success and is_over)
