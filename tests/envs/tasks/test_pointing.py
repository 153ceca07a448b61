"""Pointing while an episode runs: another target, a place of the main picture, a painted mask."""

import numpy as np
import pytest
from toy_reach.env import ReachEnv

from lerobot_excav.envs.machines.excavator.constants import MACHINE_POS_W
from lerobot_excav.envs.masks.source import MaskMissingError
from lerobot_excav.envs.tasks.clear.env import ClearEnv
from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.errors import ConfigurationError

STILL = np.zeros(4, np.float32)


@pytest.fixture(scope="module", params=[ExcavatorEnv, ClearEnv])
def env(request):
    env = request.param(fidelity="fast", render_mode=None)
    yield env
    env.close()


@pytest.fixture(scope="module")
def arm():
    env = FR5GraspEnv(render_mode=None)
    yield env
    env.close()


def shown(observation):
    return observation["pixels"]["target_mask"][..., 0] > 0


def middle(pixels):
    rows, columns = np.nonzero(pixels)
    return (columns.mean() + 0.5) / pixels.shape[1], (rows.mean() + 0.5) / pixels.shape[0]


def test_another_target_of_the_scene_is_commanded_from_the_next_action_on(env):
    env.reset(options={"scene_id": 2, "target_id": 0})
    env.step(STILL)
    observation, info = env.recommand(1)
    assert (info["target_id"], info["command_frame"]) == (1, 1)
    assert env.target_id == 1
    assert [(command.since_frame, command.target_id) for command in env.commands] == [(0, 0), (1, 1)]
    assert (shown(observation) == env.true_mask(env.command)).all()
    *_, info = env.step(STILL)
    assert (info["target_id"], info["command_frame"]) == (1, 1)


def test_a_perfect_mask_fits_its_target_however_that_was_commanded(arm):
    arm.reset(options={"scene_id": 2, "target_id": 0})
    arm.step(arm.holding_action())
    _, info = arm.recommand(1)
    while "episode_metrics" not in info:
        *_, info = arm.step(arm.holding_action())
    assert info["episode_metrics"]["mask_iou"] == 1.0


def test_what_is_commanded_before_the_first_action_is_the_first_command(env):
    env.reset(options={"scene_id": 2, "target_id": 0})
    env.recommand(1)
    assert [(command.since_frame, command.target_id) for command in env.commands] == [(0, 1)]


@pytest.mark.parametrize(("x", "y"), [(0.45, 0.6), (0.62, 0.55)])
def test_a_point_of_the_picture_becomes_a_region_around_it(env, x, y):
    env.reset(options={"scene_id": 2, "target_id": 0})
    env.step(STILL)
    count = len(env.scene.targets)
    observation, _ = env.point_at(x, y)
    assert env.target_id == count
    at = middle(shown(observation))
    assert np.hypot(at[0] - x, at[1] - y) < 0.03
    place_w = env.places_w()[int(y * 96), int(x * 128)]
    np.testing.assert_allclose(env.target.center_w, place_w, atol=1e-6)
    *_, info = env.step(STILL)
    assert info["target_id"] == count


def test_a_painted_mask_is_shown_as_it_was_painted_and_judged_by_its_middle(env):
    env.reset(options={"scene_id": 2, "target_id": 0})
    pixels = np.zeros((96, 128), dtype=bool)
    pixels[50:58, 50:70] = True
    observation, _ = env.point_with(pixels)
    assert (shown(observation) == pixels).all()
    assert env.mask.source == "pointed"
    covered_w = env.places_w()[pixels]
    np.testing.assert_allclose(env.target.center_w, covered_w.mean(axis=0), atol=1e-6)
    # What comes after it is the simulator's again.
    assert (shown(env.recommand(0)[0]) == env.true_mask(env.command)).all()


@pytest.mark.parametrize(
    ("x", "y", "words"), [(0.01, 0.01, "nothing to act on"), (0.999, 0.999, "nothing to act on|from the swing axis")]
)
def test_a_point_beside_the_soil_or_out_of_reach_is_refused_and_changes_nothing(env, x, y, words):
    env.reset(options={"scene_id": 2, "target_id": 0})
    before = env.commands
    with pytest.raises(ConfigurationError, match=words):
        env.point_at(x, y)
    assert env.commands == before


def test_every_place_that_can_be_pointed_at_is_one_that_the_machine_reaches(env):
    env.reset(options={"scene_id": 2, "target_id": 0})
    reached = []
    for x in np.linspace(0.02, 0.98, 13):
        for y in np.linspace(0.02, 0.98, 13):
            try:
                env.point_at(x, y)
            except ConfigurationError:
                continue
            reached.append(np.hypot(*(env.target.center_w[:2] - MACHINE_POS_W[:2])))
    assert len(reached) > 10
    assert 2.6 <= min(reached) <= max(reached) <= 6.4


def test_a_mask_of_another_size_or_of_nothing_is_refused(env):
    env.reset(options={"scene_id": 2, "target_id": 0})
    for pixels, words in (
        (np.ones((48, 64), dtype=bool), r"give \(96, 128\) of bool"),
        (np.ones((96, 128), dtype=np.uint8), r"give \(96, 128\) of bool"),
        (np.zeros((96, 128), dtype=bool), "covers nothing"),
    ):
        with pytest.raises(ConfigurationError, match=words):
            env.point_with(pixels)


def test_a_keep_out_zone_bars_pointing_too():
    env = ClearEnv(fidelity="fast", render_mode=None, keep_out="-3,-3,3,-0.2")
    env.reset(options={"scene_id": 2})
    place_w = env.places_w()
    inside = (place_w[..., 1] < -0.5) & (np.abs(place_w[..., 0]) < 0.5)
    row, column = np.argwhere(inside)[0]
    with pytest.raises(ConfigurationError, match="bars this place"):
        env.point_at((column + 0.5) / 128, (row + 0.5) / 96)
    assert len(env.scene.targets) == len(env.plan.proposals)
    row, column = np.argwhere((place_w[..., 1] > 0.8) & (np.abs(place_w[..., 0]) < 0.5))[0]
    env.point_at((column + 0.5) / 128, (row + 0.5) / 96)
    assert env.target.center_w[1] > 0.8
    env.close()


def test_places_may_be_pointed_at_again_and_again_in_one_frame(env):
    env.reset(options={"scene_id": 2, "target_id": 0})
    env.step(STILL)
    for x in (0.45, 0.5, 0.55):
        env.point_at(x, 0.6)
    assert [command.since_frame for command in env.commands] == [0, 1]
    assert env.command.region is env.target


def test_a_load_that_was_dug_before_pointing_is_not_dug_at_the_new_place():
    env = ExcavatorEnv(fidelity="fast", obs_type="agent_pos", render_mode=None)
    env.reset(options={"scene_id": 2, "target_id": 0})
    operator = env.task_spec.make_operator(np.random.default_rng(0))
    operator.reset(env)
    while env.cycle.state.bucket_mass_kg < 200.0:
        env.step(operator.act(env))
    assert env.cycle.target_hit
    env.recommand(1)
    for _ in range(5):
        env.step(STILL)
    assert env.cycle.target_hit is None
    env.close()


def test_the_arm_is_pointed_at_a_block_and_at_nothing_else(arm):
    arm.reset(options={"scene_id": 3, "target_id": 0})
    for block in (2, 1, 3):
        arm.recommand(block)
        x, y = middle(arm.true_mask(arm.command))
        arm.recommand(0)
        arm.point_at(x, y)
        assert arm.target_id == block
    arm.point_with(arm.true_mask(arm.commands[-1]))
    assert arm.target_id == 3
    with pytest.raises(ConfigurationError, match="no block"):
        arm.point_at(0.5, 0.98)


def test_a_task_without_places_says_so_and_a_source_that_finds_nothing_leaves_the_command_as_it_was(monkeypatch):
    toy = ReachEnv()
    toy.reset(options={"scene_id": 0, "target_id": 1})
    with pytest.raises(ConfigurationError, match="cannot be pointed at a place"):
        toy.point_at(0.5, 0.5)
    monkeypatch.setattr(toy._named_source, "mask", lambda view, command: None)
    commands, mask = toy.commands, toy.mask
    with pytest.raises(MaskMissingError, match="does not find target 2"):
        toy.recommand(2)
    assert toy.commands == commands
    assert toy.mask is mask is not None
    toy.close()


def test_an_episode_that_is_over_takes_no_command():
    toy = ReachEnv(episode_length=1)
    toy.reset(options={"scene_id": 0, "target_id": 1})
    toy.step(np.zeros(2, np.float32))
    with pytest.raises(ConfigurationError, match="is over"):
        toy.recommand(2)
    toy.close()
