"""What the environment of every task does with commands and masks, on the small task of the examples."""

import numpy as np
import pytest
from toy_reach.env import ReachEnv
from toy_reach.table import draw_spots

from lerobot_excav.envs.masks.overlay import tinted
from lerobot_excav.envs.masks.source import TargetMask, register_mask_source
from lerobot_excav.envs.tasks.commanded import MASK_MISSING_LIMIT_S
from lerobot_excav.errors import ConfigurationError

STILL = np.zeros(2, np.float32)


class LateSource:
    """Finds the target after it has been asked a number of times."""

    misses = 0

    def mask(self, view, command):
        type(self).misses -= 1
        if self.misses >= 0:
            return None
        return TargetMask(pixels=view.true_mask(command), target_id=command.target_id, source="late")


register_mask_source("late", LateSource)


def masks_of(observation):
    return observation["pixels"]["target_mask"]


def true_masks(env):
    return [env.renderer.spot_pixels(spot) for spot in range(4)]


def test_a_schedule_changes_target_mask_and_metrics_at_its_frames():
    env = ReachEnv(episode_length=9)
    observation, info = env.reset(options={"scene_id": 5, "target_id": 1, "commands": [(3, 0), (6, 2)]})
    shown, targets = [masks_of(observation)], [info["target_id"]]
    for _ in range(9):
        observation, *_, info = env.step(STILL)
        shown.append(masks_of(observation))
        targets.append(info["target_id"])
    assert targets == [1] * 3 + [0] * 3 + [2] * 4
    for mask, target in zip(shown, targets, strict=True):
        assert np.array_equal(mask[..., 0] > 0, true_masks(env)[target])
    assert info["episode_metrics"]["commands"] == [[0, 1], [3, 0], [6, 2]]
    assert info["episode_metrics"]["target_id"] == 1
    assert info["episode_metrics"]["shown_target_id"] == 2
    env.reset(options={"scene_id": 5, "target_id": 1})  # forgets the schedule
    assert [env.step(STILL)[4]["target_id"] for _ in range(4)] == [1] * 4
    assert [(c.since_frame, c.target_id, c.region) for c in env.commands] == [(0, 1, 1)]


def test_a_machine_is_held_still_until_its_mask_is_found():
    env = ReachEnv(mask_source="late", episode_length=40)
    LateSource.misses = 3
    observation, info = env.reset(seed=2)
    assert not info["mask_missing"]
    assert masks_of(observation).any()
    assert np.array_equal(env.world.pos_w, np.zeros(2))
    ended = [env.step(np.ones(2, np.float32))[3:] for _ in range(37)]
    # The three held frames count towards the time limit.
    assert [truncated for truncated, _ in ended] == [False] * 36 + [True]
    metrics = ended[-1][1]["episode_metrics"]
    assert (metrics["frames"], metrics["mask_missing_frames"], metrics["mask_missing"]) == (37, 3, False)


def test_a_mask_that_is_lost_with_a_new_command_holds_the_machine_within_a_step():
    env = ReachEnv(mask_source="late", episode_length=40)
    LateSource.misses = 0
    env.reset(options={"scene_id": 2, "target_id": 0, "commands": [(2, 1)]})
    env.step(STILL)
    LateSource.misses = 4
    observation, *_, info = env.step(STILL)
    assert info["target_id"] == 1
    assert np.array_equal(masks_of(observation)[..., 0] > 0, true_masks(env)[1])
    assert env._missing_frames == 4


def test_an_episode_without_a_mask_is_given_up_and_no_action_is_carried_out():
    env = ReachEnv(mask_source="late", episode_length=400)
    LateSource.misses = 10_000
    _, info = env.reset(seed=2)
    assert info["mask_missing"]
    *_, terminated, truncated, info = env.step(np.ones(2, np.float32))
    assert (terminated, truncated, info["is_success"]) == (False, True, False)
    assert np.array_equal(env.world.pos_w, np.zeros(2))
    metrics = info["episode_metrics"]
    assert (metrics["frames"], metrics["mask_missing"]) == (0, True)
    assert metrics["mask_missing_frames"] == round(MASK_MISSING_LIMIT_S * env.fps)
    assert metrics["shown_target_id"] == -1


def test_held_pictures_are_drawn_again_with_a_new_command_and_in_a_new_episode():
    still = np.zeros(2, np.float32)
    env = ReachEnv(camera_every=50)
    first, _ = env.reset(seed=2, options={"commands": [(4, 3)]})
    pixels = [first["pixels"], *(env.step(still)[0]["pixels"] for _ in range(6))]
    masks = [each["target_mask"].tobytes() for each in pixels]
    assert len(set(masks[:4])) == len(set(masks[4:])) == 1
    assert masks[3] != masks[4]
    assert np.array_equal(env.reset(seed=3)[0]["pixels"]["main"], ReachEnv().reset(seed=3)[0]["pixels"]["main"])


@pytest.mark.parametrize("condition", ["correct", "mismatched", "zero"])
def test_an_overlay_tints_the_mask_as_shown_into_the_main_view_alone(condition):
    def start(**settings):
        return ReachEnv(mask_condition=condition, mask_noise_px=0, **settings).reset(seed=6)[0]["pixels"]

    plain, over = start(), start(target_overlay=True)
    assert np.array_equal(over["main"], tinted(plain["main"], plain["target_mask"][..., 0] > 0))
    assert np.array_equal(over["main"], plain["main"]) == (condition == "zero")
    assert all(np.array_equal(over[camera], plain[camera]) for camera in ("near", "target_mask"))


def test_the_overlay_shows_noise_and_leaves_what_people_see():
    settings = {"mask_noise": "shift", "mask_noise_px": 5}
    env, plain = ReachEnv(target_overlay=True, **settings), ReachEnv(**settings)
    observation, _ = env.reset(seed=6)
    plain.reset(seed=6)
    noisy = masks_of(observation)[..., 0] > 0
    assert not np.array_equal(noisy, true_masks(env)[2])
    assert np.array_equal(observation["pixels"]["main"], tinted(env.picture(), noisy))
    assert np.array_equal(env.render(), plain.render())


def test_depth_is_registered_with_the_main_view():
    env = ReachEnv(depth_info=True)
    _, info = env.reset(seed=0)
    assert info["depth_m"].shape == (96, 128)
    ground_w = env.camera.points_w(info["depth_m"])
    assert np.abs(ground_w[..., 2]).max() < 1e-5
    # The true mask is where the points lie on the spot.
    inside = np.linalg.norm(ground_w[..., :2] - draw_spots("train", 0)[0], axis=-1) <= 0.12
    assert np.array_equal(inside, true_masks(env)[0])


def test_without_pictures_no_mask_is_asked_for():
    LateSource.misses = 10_000
    env = ReachEnv(obs_type="agent_pos", mask_source="late")
    observation, info = env.reset(seed=0)
    assert list(observation) == ["agent_pos"]
    assert not info["mask_missing"]
    assert LateSource.misses == 10_000


@pytest.mark.parametrize(
    ("settings", "named"),
    [
        ({"colour": 1}, "colour is not a setting of toy_reach; allowed: task, fps"),
        ({"obs_type": "state"}, "obs_type='state' .*'agent_pos'"),
        ({"render_mode": "human"}, "render_mode='human' .*'rgb_array'"),
        ({"task": "Dig-v0"}, "task='Dig-v0'"),
    ],
)
def test_bad_arguments_name_the_field_and_what_is_allowed(settings, named):
    with pytest.raises(ConfigurationError, match=named):
        ReachEnv(**settings)


def test_step_and_command_before_reset_say_so():
    for use in (lambda env: env.step(STILL), lambda env: env.command):
        with pytest.raises(ConfigurationError, match="reset"):
            use(ReachEnv())


def test_no_command_follows_the_action_that_ends_an_episode(monkeypatch):
    env = ReachEnv(obs_type="agent_pos")
    env.reset(options={"scene_id": 2, "target_id": 0, "commands": [(2, 1)]})
    env.step(STILL)
    monkeypatch.setattr(env, "_advance", lambda action: (1.0, True))
    *_, terminated, _, info = env.step(STILL)
    assert (terminated, info["target_id"]) == (True, 0)
    assert info["episode_metrics"]["commands"] == [[0, 0]]


def test_an_environment_takes_its_own_tasks_only():
    with pytest.raises(ConfigurationError, match=r"task='Scoop-v0' .*Reach-v0"):
        ReachEnv(task="Scoop-v0")
