from dataclasses import replace

import numpy as np
import pytest

from lerobot_excav.envs.tasks.grasp.spec import GRASP
from lerobot_excav.envs.tasks.selection import select_episode
from lerobot_excav.errors import ConfigurationError


def select(seed=None, rng_seed=0, targets=4, **options):
    rng = np.random.default_rng(rng_seed)
    chosen = select_episode(seed, options, rng=rng, task=replace(GRASP, target_count=targets), length=400)
    return chosen.scene_id, chosen.target_id, chosen.schedule


@pytest.mark.parametrize(
    ("seed", "targets", "options", "expected"),
    [
        (0, 4, {}, (0, 0, None)),
        (1006, 4, {}, (1006, 2, None)),
        (5, 3, {}, (5, 2, None)),
        (1006, 4, {"scene_id": 3, "target_id": 1}, (3, 1, None)),
        (1006, 4, {"target_id": 1}, (1006, 1, None)),
        (1006, 4, {"scene_id": 7}, (7, 3, None)),
        (6, 4, {"lerobot_new_rollout": True}, (6, 2, None)),
        (6, 4, {"commands": []}, (6, 2, ())),
        (6, 4, {"commands": [[3, 1], (9, 0)]}, (6, 2, ((3, 1), (9, 0)))),
    ],
)
def test_options_go_before_the_seed_whose_remainder_is_the_target(seed, targets, options, expected):
    assert select(seed, targets=targets, **options) == expected


def test_without_either_the_generator_decides():
    assert select(rng_seed=1) == select(rng_seed=1) != select(rng_seed=2)


def test_numpy_integers_become_pythons_own():
    scene_id, target_id, schedule = select(scene_id=np.int64(3), target_id=np.int32(1), commands=np.array([[2, 3]]))
    assert {type(number) for number in (scene_id, target_id, *schedule[0])} == {int}


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"scene_id": 1.5}, r"scene_id=1\.5"),
        ({"scene_id": -1}, "scene_id=-1 .*from 0"),
        ({"scene_id": 2**63}, "scene_id=9223372036854775808"),
        ({"target_id": True}, "target_id=True"),
        ({"target_id": 4}, "target_id=4 .*from 0 to 3"),
        ({"scene": 3}, "options='scene' .*'scene_id', 'target_id', 'stage', 'commands'"),
        ({"stage": 1}, "stage=1 .*no stages"),
        ({"commands": [(0, 1)]}, "commands: frame=0 .*from 1 to 399"),
        ({"commands": [(4, 1), (4, 2)]}, "commands: frame=4 .*from 5 to 399"),
        ({"commands": [(400, 1)]}, "commands: frame=400 .*from 1 to 399"),
        ({"commands": [5]}, "5 is not a pair"),
        ({"commands": {3: 1}}, "is not a list of pairs"),
        ({"commands": iter([(3, 1)])}, "is not a list of pairs"),
        ({"commands": [(4, 7)]}, "commands: target_id=7 .*from 0 to 3"),
        ({"commands": [(4, 1, 2)]}, "is not a pair"),
    ],
)
def test_unusable_options_are_refused(options, named):
    with pytest.raises(ConfigurationError, match=named):
        select(**options)


def test_stages_go_as_far_as_the_task_has_any():
    def stage_of(options, last_stage):
        rng = np.random.default_rng(0)
        return select_episode(0, options, rng=rng, task=replace(GRASP, last_stage=last_stage), length=400).stage

    assert stage_of({}, 15) == stage_of({"stage": 0}, 0) == 0
    assert stage_of({"stage": np.int64(15)}, 15) == 15
    with pytest.raises(ConfigurationError, match=r"stage=16 .*from 0 to 15"):
        stage_of({"stage": 16}, 15)
