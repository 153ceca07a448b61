import numpy as np
import pytest

from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.operator import PHASES
from lerobot_excav.envs.tasks.scoop.operator.variation import Tremor

from .conftest import drive


@pytest.fixture(scope="module")
def env():
    return ExcavatorEnv(scene_set="val", obs_type="agent_pos")


@pytest.mark.slow
@pytest.mark.parametrize("scene_id", range(3))
@pytest.mark.parametrize("target_id", range(4))
def test_operator_digs_every_target_of_a_scene(env, scene_id, target_id):
    actions, _, metrics = drive(env, scene_id=scene_id, target_id=target_id, seed=scene_id)
    assert metrics["target_success"]
    assert metrics["is_success"]
    assert metrics["hard_target_contacts"] == 0
    assert 350.0 <= metrics["retained_mass_kg"] <= 600.0
    assert np.abs(actions).max() <= 1.0


def test_operator_goes_through_its_phases_in_order(env):
    _, phases, _ = drive(env, scene_id=0, target_id=0, seed=0)
    ranks = [PHASES.index(phase) for phase in phases]
    assert ranks == sorted(ranks)
    assert set(phases) >= set(PHASES[:-1])


@pytest.mark.slow
def test_same_generator_gives_the_same_demonstration_and_another_another_style(env):
    first, again, other = (drive(env, scene_id=1, target_id=2, seed=seed)[0] for seed in (3, 3, 4))
    assert np.array_equal(first, again)
    assert first.shape != other.shape or not np.allclose(first, other)


def test_tremor_has_the_size_it_is_given():
    tremor = Tremor(np.random.default_rng(0), size=0.05)
    values = np.array([tremor.step(0.1) for _ in range(4000)])
    assert values.std() == pytest.approx(0.05, rel=0.1)
    still = Tremor(np.random.default_rng(0), size=0.0)
    assert not still.step(0.1).any()
