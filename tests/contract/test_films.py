"""Every environment can write a film of its episodes, to the very last picture."""

import av
import numpy as np
import pytest

from lerobot_excav.envs.tasks.registry import TASKS
from lerobot_excav.errors import ConfigurationError

pytestmark = pytest.mark.slow

LENGTH = 7
SMALL = {"film_height": 64, "film_width": 96, "episode_length": LENGTH}


@pytest.fixture(params=list(TASKS))
def make(request, tmp_path):
    """Make an environment of every task, with films in a folder, and close it in the end."""
    made = []

    def new(**settings):
        spec = TASKS[request.param]
        made.append(
            spec.make_env(**{"film_folder": str(tmp_path / "films"), "obs_type": "agent_pos", **SMALL, **settings})
        )
        return made[-1]

    yield new
    for env in made:
        env.close()


def play(env, frames=LENGTH, **options):
    env.reset(options={"scene_id": 2, **options})
    for _ in range(frames):
        env.step(env.holding_action())
    return env


def read(path):
    with av.open(str(path)) as container:
        rate = container.streams.video[0].average_rate
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)], rate


def films(tmp_path):
    return sorted((tmp_path / "films").iterdir()) if (tmp_path / "films").exists() else []


def test_a_film_has_every_picture_from_the_first_to_the_outcome(make, tmp_path):
    env = play(make(film_height=480, film_width=640))
    (path,) = films(tmp_path)
    assert path.name == f"{env.task}_train_2_0_{env.commands[0].target_id}.mp4"
    pictures, rate = read(path)
    assert (len(pictures), pictures[0].shape, rate) == (LENGTH + 1, (480, 640, 3), env.fps)
    env.render_settings.render_height, env.render_settings.render_width = 480, 640
    error = np.abs(pictures[-1].astype(int) - env.render()).mean()  # the caption says how it ended
    assert error < 6.0
    assert error < 0.5 * np.abs(pictures[0].astype(int) - env.render()).mean() + 3.0


def test_a_time_lapse_has_every_third_picture_and_the_end(make, tmp_path):
    play(make(film_every=3))
    pictures, _ = read(films(tmp_path)[0])
    assert len(pictures) == 4  # 0, 3, 6 and the end at 7
    assert pictures[0].shape == (64, 96, 3)


def test_films_need_no_pictures_for_anybody_else(make, tmp_path):
    env = play(make(render_mode=None))
    assert env.render() is None
    assert len(films(tmp_path)) == 1


def test_an_episode_that_does_not_come_to_its_end_leaves_no_film(make, tmp_path):
    env = play(make(), frames=3)
    play(env, frames=3, scene_id=3)
    env.close()
    assert films(tmp_path) == []


def test_a_film_of_the_same_episode_is_not_replaced(make, tmp_path):
    env = play(make())
    (first,) = films(tmp_path)
    before = first.read_bytes()
    play(env)
    play(env)
    names = [path.stem for path in films(tmp_path)]
    assert names == [first.stem, f"{first.stem}_2", f"{first.stem}_3"]
    assert first.read_bytes() == before


def test_a_frame_after_the_end_is_not_filmed(make, tmp_path):
    env = play(make())
    before = films(tmp_path)[0].read_bytes()
    env.step(env.holding_action())
    assert [path.read_bytes() for path in films(tmp_path)] == [before]


@pytest.mark.parametrize("setting", ["film_height", "film_width", "film_every"])
def test_what_is_said_of_films_needs_a_folder(make, setting):
    with pytest.raises(ConfigurationError, match=f"{setting}=50 has no effect without a folder"):
        make(**{"film_folder": None, "film_height": 480, "film_width": 640, setting: 50})


def test_whether_a_film_is_made_changes_nothing_that_is_observed(make):
    states = []
    for folder in (None, "films"):
        settings = {} if folder else {"film_folder": None, "film_height": 480, "film_width": 640}
        env = make(**settings)
        observation, _ = env.reset(options={"scene_id": 4})
        for _ in range(3):
            observation, *_ = env.step(env.action_space.high)
        states.append(observation["agent_pos"])
    assert np.array_equal(*states)
