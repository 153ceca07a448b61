import numpy as np
import pytest

from lerobot_excav.envs.soil import FIDELITIES
from lerobot_excav.envs.tasks.scoop.env import FULL_BUCKET_KG, ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.operator import ScriptedOperator
from lerobot_excav.envs.tasks.scoop.targets import target_mask_img
from lerobot_excav.errors import ConfigurationError


def rollout(env, action, frames):
    return [env.step(action) for _ in range(frames)][-1]


@pytest.fixture(scope="module")
def env():
    env = ExcavatorEnv(obs_type="agent_pos")
    yield env
    env.close()


@pytest.fixture(scope="module")
def seeing_env():
    env = ExcavatorEnv()
    yield env
    env.close()


def test_seed_selects_scene_and_target(env):
    _, info = env.reset(seed=1006)
    assert (info["scene_id"], info["target_id"]) == (1006, 2)


def test_options_select_scene_and_target_over_the_seed(env):
    _, info = env.reset(seed=1006, options={"scene_id": 3, "target_id": 1, "lerobot_new_rollout": True})
    assert (info["scene_id"], info["target_id"]) == (3, 1)


def test_a_scene_without_a_target_takes_the_one_of_its_seed(env):
    _, info = env.reset(seed=1006, options={"scene_id": 7})
    assert (info["scene_id"], info["target_id"]) == (7, 3)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"scene_id": 1.5}, r"scene_id=1\.5"),
        ({"scene_id": "3"}, "scene_id='3'"),
        ({"scene_id": -1}, "scene_id=-1 .*from 0"),
        ({"scene_id": 2**63}, "scene_id=9223372036854775808"),
        ({"target_id": True}, "target_id=True"),
        ({"target_id": 4}, "target_id=4 .*from 0 to 3"),
        ({"scene": 3}, "options='scene' .*'scene_id', 'target_id'"),
    ],
)
def test_unusable_options_are_refused(env, options, named):
    with pytest.raises(ConfigurationError, match=named):
        env.reset(options=options)


def test_unseeded_resets_draw_new_scenes(env):
    env.reset(seed=0)
    assert env.reset()[1]["scene_id"] != env.reset()[1]["scene_id"]


def test_reset_restores_the_start_exactly_after_anything(env):
    first, _ = env.reset(seed=5)
    heights = env.worksite.soil.heights_m.tobytes()
    rollout(env, np.array([-1.0, -1.0, 0.3, 0.5]), 40)
    again, _ = env.reset(seed=5)
    assert np.array_equal(first["agent_pos"], again["agent_pos"])
    assert env.worksite.soil.heights_m.tobytes() == heights
    assert env.worksite.soil.ledger_kg()["box"] == 0.0


def test_zero_command_holds_still(env):
    start, _ = env.reset(seed=1)
    end = rollout(env, np.zeros(4), 30)[0]
    assert np.abs(end["agent_pos"][:4] - start["agent_pos"][:4]).max() < 0.005


def test_actions_beyond_full_stick_are_clipped(env):
    env.reset(seed=1)
    clipped = rollout(env, np.array([1.0, 1.0, -1.0, 0.0]), 5)[0]["agent_pos"]
    env.reset(seed=1)
    assert np.array_equal(rollout(env, np.array([7.0, 1.5, -3.0, 0.0]), 5)[0]["agent_pos"], clipped)


@pytest.mark.parametrize("action", [np.zeros(3), np.zeros((1, 4)), np.array([0, np.nan, 0, 0])])
def test_unusable_action_is_refused_and_moves_nothing(env, action):
    env.reset(seed=1)
    before = env.worksite.machine.joint_pos
    with pytest.raises(ConfigurationError, match="action"):
        env.step(action)
    assert np.array_equal(env.worksite.machine.joint_pos, before)


@pytest.mark.parametrize("fps", [5, 25])
def test_frame_lasts_one_over_fps(fps):
    env = ExcavatorEnv(fps=fps, obs_type="agent_pos")
    env.reset(seed=0)
    rollout(env, np.zeros(4), fps)
    assert env.worksite.time_s == pytest.approx(1.0)
    assert env.metadata["render_fps"] == fps


def test_time_limit_truncates_and_hands_out_the_metrics():
    env = ExcavatorEnv(episode_length=3, obs_type="agent_pos")
    env.reset(seed=0)
    assert "episode_metrics" not in rollout(env, np.zeros(4), 2)[4]
    _, _, terminated, truncated, info = env.step(np.zeros(4))
    assert (terminated, truncated) == (False, True)
    assert info["episode_metrics"]["frames"] == 3
    assert info["episode_metrics"]["is_success"] is False


@pytest.mark.parametrize(("fps", "frames"), [(10, 200), (25, 500)])
def test_an_episode_lasts_20_s_unless_told(fps, frames):
    assert ExcavatorEnv(fps=fps, obs_type="agent_pos").episode_length == frames


@pytest.mark.parametrize(
    ("kwargs", "named"),
    [
        ({"task": "Dig-v0"}, "'Scoop-v0'"),
        ({"fps": 30}, "fps=30"),
        ({"observation_height": 8}, "observation_height=8"),
        ({"scene_set": "eval"}, "'train', 'val', 'test'"),
        ({"mask_condition": "wrong"}, "'mismatched'"),
        ({"soil": "mud"}, "'wet_sand'"),
        ({"fidelity": "exact"}, "'fine'"),
        ({"obs_type": "state"}, "'agent_pos'"),
        ({"render_mode": "human"}, "'rgb_array'"),
        ({"episode_length": 0}, "episode_length=0"),
        ({"episode_length": True}, "episode_length=True"),
    ],
)
def test_bad_settings_name_the_field_and_what_is_allowed(kwargs, named):
    with pytest.raises(ConfigurationError, match=named):
        ExcavatorEnv(**kwargs)


def test_step_before_reset_says_so():
    with pytest.raises(ConfigurationError, match="reset"):
        ExcavatorEnv(obs_type="agent_pos").step(np.zeros(4))


def test_scene_set_changes_the_scene(env):
    heights = {}
    for scene_set in ("train", "val", "test"):
        other = ExcavatorEnv(scene_set=scene_set, obs_type="agent_pos")
        other.reset(seed=7)
        heights[scene_set] = other.scene.heights_m.tobytes()
    assert len(set(heights.values())) == 3


@pytest.mark.parametrize("fidelity", ["fast", "standard", "fine"])
def test_fidelity_reaches_soil_and_metrics(fidelity):
    env = ExcavatorEnv(fidelity=fidelity, episode_length=1, obs_type="agent_pos")
    env.reset(seed=0)
    assert env.worksite.soil.fidelity == FIDELITIES[fidelity]
    assert env.step(np.zeros(4))[4]["episode_metrics"]["fidelity"] == fidelity


def test_fidelity_changes_the_course_of_the_soil():
    taken_kg = set()
    for fidelity in FIDELITIES:
        env = ExcavatorEnv(fidelity=fidelity, obs_type="agent_pos")
        env.reset(seed=2)
        operator = ScriptedOperator(rng=np.random.default_rng(0))
        operator.reset(env)
        while env.worksite.soil.payload_mass_kg < 20.0:
            env.step(operator.act(env))
        taken_kg.add(env.worksite.soil.payload_mass_kg)
    assert len(taken_kg) == len(FIDELITIES)


def test_mask_shows_the_commanded_patch_of_the_soil(seeing_env):
    observation, _ = seeing_env.reset(seed=2)
    mask = observation["pixels"]["target_mask"]
    points_w = seeing_env.renderer.terrain_points_w(seeing_env.worksite.soil)
    assert np.array_equal(mask, target_mask_img(seeing_env.target, points_w))
    center_w = np.nanmean(points_w[mask[..., 0] == 255], axis=0)
    assert np.hypot(*(center_w - seeing_env.target.center_w)[:2]) < 0.25


def test_all_targets_of_a_scene_are_seen_and_differ(seeing_env):
    masks = []
    for target_id in range(4):
        observation, _ = seeing_env.reset(options={"scene_id": 9, "target_id": target_id})
        masks.append(observation["pixels"]["target_mask"])
        assert (masks[-1][..., 0] == 255).sum() >= 50
    assert len({m.tobytes() for m in masks}) == 4


def test_paired_resets_differ_in_the_mask_only(seeing_env):
    a, _ = seeing_env.reset(options={"scene_id": 4, "target_id": 0})
    b, _ = seeing_env.reset(options={"scene_id": 4, "target_id": 3})
    assert np.array_equal(a["agent_pos"], b["agent_pos"])
    assert np.array_equal(a["pixels"]["main"], b["pixels"]["main"])
    assert not np.array_equal(a["pixels"]["target_mask"], b["pixels"]["target_mask"])


def test_mask_stays_as_it_was_at_the_start_of_the_cycle(seeing_env):
    start, _ = seeing_env.reset(seed=2)
    end = rollout(seeing_env, np.array([-1.0, -0.5, 0.0, 0.0]), 10)[0]
    assert np.array_equal(start["pixels"]["target_mask"], end["pixels"]["target_mask"])
    assert not np.array_equal(start["pixels"]["main"], end["pixels"]["main"])


@pytest.mark.parametrize("condition", ["zero", "random", "mismatched"])
def test_mask_condition_corrupts_the_mask_alone(seeing_env, condition):
    right, _ = seeing_env.reset(seed=6)
    env = ExcavatorEnv(mask_condition=condition)
    shown, _ = env.reset(seed=6)
    env.close()
    assert np.array_equal(right["pixels"]["main"], shown["pixels"]["main"])
    assert not np.array_equal(right["pixels"]["target_mask"], shown["pixels"]["target_mask"])


@pytest.mark.parametrize("condition", ["random", "mismatched"])
def test_a_corrupted_mask_depends_on_scene_and_target_alone(condition):
    env = ExcavatorEnv(mask_condition=condition)

    def mask(scene_id, target_id, seed=None):
        options = {"scene_id": scene_id, "target_id": target_id}
        return env.reset(seed=seed, options=options)[0]["pixels"]["target_mask"]

    first = mask(6, 2)
    assert np.array_equal(mask(6, 2), first)
    assert np.array_equal(mask(6, 2, seed=99), first)
    assert np.array_equal(env.reset(seed=6)[0]["pixels"]["target_mask"], first)
    assert not np.array_equal(mask(7, 2), first)
    env.close()


def test_rendering_draws_the_main_view_once_per_state(monkeypatch):
    env = ExcavatorEnv()
    drawn = []
    render = env.renderer.render
    monkeypatch.setattr(
        env.renderer, "render", lambda camera, soil: (drawn.append(camera), render(camera, soil))[1]
    )

    def assert_fresh(shown):
        assert np.array_equal(shown, render("main", env.worksite.soil))

    observation, _ = env.reset(seed=2)
    env.render()[...] = 0
    assert drawn.count("main") == 1
    assert_fresh(env.render())
    for _ in range(5):
        observation = env.step(np.array([1.0, 0.5, 0.0, 0.0]))[0]
    assert np.array_equal(env.render(), observation["pixels"]["main"])
    assert drawn.count("main") == 6
    env.worksite.tick(np.ones(4))
    assert_fresh(env.render())
    env.reset(seed=3)
    assert_fresh(env.render())
    env.close()


def test_render_and_depth_are_registered_with_main(seeing_env):
    observation, _ = seeing_env.reset(seed=2)
    assert np.array_equal(seeing_env.render(), observation["pixels"]["main"])
    depth_m = seeing_env.depth_m()
    assert depth_m.shape == observation["pixels"]["main"].shape[:2]
    assert np.isfinite(depth_m).all()
    assert ExcavatorEnv(obs_type="agent_pos", render_mode=None).render() is None


def test_depth_comes_with_the_info_on_request(seeing_env):
    observation, info = seeing_env.reset(seed=2)
    assert "depth_m" not in info
    env = ExcavatorEnv(depth_info=True)
    same, info = env.reset(seed=2)
    start_m = info["depth_m"]
    assert np.array_equal(same["pixels"]["main"], observation["pixels"]["main"])
    assert (start_m.shape, start_m.dtype) == ((96, 128), np.float32)
    assert np.array_equal(start_m, env.depth_m())
    moved_m = env.step(np.ones(4))[4]["depth_m"]
    assert np.array_equal(moved_m, env.depth_m())
    assert not np.array_equal(moved_m, start_m)
    env.close()


def test_successful_cycle_pays_its_soil_and_one_for_success(env):
    env.reset(options={"scene_id": 0, "target_id": 0})
    operator = ScriptedOperator(rng=np.random.default_rng(0))
    operator.reset(env)
    total, terminated, truncated, info = 0.0, False, False, {}
    while not (terminated or truncated):
        _, reward, terminated, truncated, info = env.step(operator.act(env))
        assert info["is_success"] is False or terminated
        total += reward
    metrics = info["episode_metrics"]
    assert terminated
    assert metrics["is_success"] is info["is_success"] is True
    assert total == pytest.approx(metrics["retained_mass_kg"] / FULL_BUCKET_KG + 1.0)
