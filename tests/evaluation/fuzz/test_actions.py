from itertools import islice

import numpy as np
import pytest

from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.operator import ScriptedOperator
from lerobot_excav.envs.tasks.scoop.operator.path import UnreachableError
from lerobot_excav.evaluation.fuzz.actions import STYLES


@pytest.fixture(scope="module")
def env():
    env = ExcavatorEnv(obs_type="agent_pos", episode_length=1000)
    env.reset(options={"scene_id": 0, "target_id": 0})
    return env


def drawn(style, env, seed=0, count=60):
    return np.stack(list(islice(STYLES[style](env, np.random.default_rng(seed)), count)))


@pytest.mark.parametrize("style", STYLES)
def test_every_style_gives_commands(env, style):
    actions = drawn(style, env)
    assert actions.dtype == np.float32
    assert actions.shape == (60, 4)
    assert np.abs(actions).max() <= 1.0


@pytest.mark.parametrize("style", STYLES)
def test_a_style_follows_its_generator(env, style):
    np.testing.assert_array_equal(drawn(style, env), drawn(style, env))
    assert not np.array_equal(drawn(style, env), drawn(style, env, seed=1))


def test_full_deflection_is_full(env):
    assert (np.abs(drawn("full", env)) == 1.0).all()


def test_jitter_ends_in_trembling_around_zero(env):
    assert np.abs(drawn("jitter", env, count=200)[150:]).max() <= 0.05


def test_press_turns_to_the_pile_first(env):
    swing = env.worksite.machine.joint_pos[0]
    assert drawn("press", env)[0, 0] == -np.sign(swing)


@pytest.mark.parametrize("style", ["dig", "spill"])
@pytest.mark.parametrize("moment", ["reset", "act"])
def test_a_style_goes_on_where_the_operator_cannot(env, monkeypatch, style, moment):
    def out_of_reach(*_):
        raise UnreachableError("too far")

    monkeypatch.setattr(ScriptedOperator, moment, out_of_reach)
    assert drawn(style, env).shape == (60, 4)
