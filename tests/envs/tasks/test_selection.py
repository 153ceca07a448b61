import numpy as np
import pytest

from lerobot_excav.envs.tasks.selection import select_scene_and_target
from lerobot_excav.errors import ConfigurationError


def select(seed=None, rng_seed=0, targets=4, **options):
    rng = np.random.default_rng(rng_seed)
    return select_scene_and_target(seed, options, rng=rng, target_count=targets)


@pytest.mark.parametrize(
    ("seed", "targets", "expected"), [(0, 4, (0, 0)), (1006, 4, (1006, 2)), (5, 3, (5, 2))]
)
def test_a_seed_is_the_scene_and_its_remainder_the_target(seed, targets, expected):
    assert select(seed, targets=targets) == expected


def test_options_go_before_the_seed():
    assert select(1006, scene_id=3, target_id=1) == (3, 1)
    assert select(1006, target_id=1) == (1006, 1)


def test_a_scene_without_a_target_takes_the_one_of_its_seed():
    assert select(1006, scene_id=7) == (7, 3)


def test_without_either_the_generator_decides():
    assert select(rng_seed=1) == select(rng_seed=1) != select(rng_seed=2)


def test_numpy_integers_become_pythons_own():
    chosen = select(scene_id=np.int64(3), target_id=np.int32(1))
    assert [type(number) for number in chosen] == [int, int]


def test_lerobots_own_options_are_passed_over():
    assert select(6, lerobot_new_rollout=True) == (6, 2)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"scene_id": 1.5}, r"scene_id=1\.5"),
        ({"scene_id": -1}, "scene_id=-1 .*from 0"),
        ({"scene_id": 2**63}, "scene_id=9223372036854775808"),
        ({"target_id": True}, "target_id=True"),
        ({"target_id": 4}, "target_id=4 .*from 0 to 3"),
        ({"scene": 3}, "options='scene' .*'scene_id', 'target_id'"),
    ],
)
def test_unusable_options_are_refused(options, named):
    with pytest.raises(ConfigurationError, match=named):
        select(**options)
