import numpy as np
import pytest

from lerobot_excav.envs.soil import FIDELITIES, PRESETS, SoilParameters
from lerobot_excav.envs.tasks.scoop.env import FULL_BUCKET_KG, ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.operator import DigOperator


def rollout(env, action, frames):
    return [env.step(action) for _ in range(frames)][-1]


def mask_of(observation):
    return observation["pixels"]["target_mask"][..., 0] == 255


def operator_for(env):
    operator = DigOperator(rng=np.random.default_rng(0))
    operator.reset(env)
    return operator


def operate(env):
    """Let the operator play to the end; return the sum of rewards, whether it is the task's end, and the last info."""
    operator, total, terminated, truncated = operator_for(env), 0.0, False, False
    while not (terminated or truncated):
        _, reward, terminated, truncated, info = env.step(operator.act(env))
        assert info["is_success"] is False or terminated
        total += reward
    return total, terminated, info


@pytest.fixture(scope="module")
def env():
    return ExcavatorEnv(obs_type="agent_pos")


@pytest.fixture(scope="module")
def seeing_env():
    env = ExcavatorEnv()
    yield env
    env.close()


def test_reset_restores_the_soil_exactly_after_anything(env):
    env.reset(seed=5)
    heights = env.worksite.soil.heights_m.tobytes()
    rollout(env, np.array([-1.0, -1.0, 0.3, 0.5]), 40)
    env.reset(seed=5)
    assert env.worksite.soil.heights_m.tobytes() == heights
    assert env.worksite.soil.ledger_kg()["box"] == 0.0


def test_two_resets_to_a_later_stage_are_the_same_and_the_regions_of_one_start_share_its_soil():
    env = ExcavatorEnv(obs_type="agent_pos", scene_set="val", fidelity="fast")

    def started(**options):
        observation, _ = env.reset(options={"scene_id": 3, "stage": 1, **options})
        soil = env.worksite.soil
        state = soil.heights_m.tobytes(), soil.container_heights_m.tobytes(), observation["agent_pos"].tobytes()
        return state, env.target.center_w.tobytes()

    first, region = started(target_id=0)
    rollout(env, np.array([-1.0, -1.0, 0.3, 0.5]), 20)
    assert started(target_id=0) == (first, region)
    again, other_region = started(target_id=1)
    assert again == first
    assert other_region != region
    assert env.stage == 1
    assert env.worksite.soil.box_mass_kg > 200.0
    env.reset(options={"scene_id": 3})
    assert env.stage == 0
    assert env.worksite.soil.box_mass_kg == 0.0


def test_actions_beyond_full_stick_are_clipped(env):
    env.reset(seed=1)
    clipped = rollout(env, np.array([1.0, 1.0, -1.0, 0.0]), 5)[0]["agent_pos"]
    env.reset(seed=1)
    assert np.array_equal(rollout(env, np.array([7.0, 1.5, -3.0, 0.0]), 5)[0]["agent_pos"], clipped)


@pytest.mark.parametrize("fps", [5, 25])
def test_frame_lasts_one_over_fps_and_an_episode_20_s(fps):
    env = ExcavatorEnv(fps=fps, obs_type="agent_pos")
    env.reset(seed=0)
    rollout(env, np.zeros(4), fps)
    assert env.worksite.time_s == pytest.approx(1.0)
    assert env.episode_length == 20 * fps


def test_fidelity_reaches_the_soil_and_changes_its_course():
    taken_kg = set()
    for name, fidelity in FIDELITIES.items():
        env = ExcavatorEnv(fidelity=name, obs_type="agent_pos")
        env.reset(seed=2)
        assert env.worksite.soil.fidelity == fidelity
        operator = operator_for(env)
        while env.worksite.soil.payload_mass_kg < 20.0:
            env.step(operator.act(env))
        taken_kg.add(env.worksite.soil.payload_mass_kg)
    assert len(taken_kg) == len(FIDELITIES)


def test_a_soil_of_ones_own_shapes_the_pile_and_is_dug():
    angles = {"friction_angle_rad": 0.7, "steel_friction_angle_rad": 0.4}
    heavy = SoilParameters(density_kg_m3=1700.0, cohesion_pa=500.0, swell=1.0, **angles)
    settings = {"obs_type": "agent_pos", "episode_length": 1}
    env, sand, again = (ExcavatorEnv(soil=soil, **settings) for soil in (heavy, "sand", PRESETS["sand"]))
    for each in (env, sand, again):
        each.reset(seed=2)
    assert env.worksite.soil.parameters is heavy
    assert not np.array_equal(env.scene.heights_m, sand.scene.heights_m)
    assert env.step(np.zeros(4))[4]["episode_metrics"]["soil"] == "custom"
    assert np.array_equal(again.scene.heights_m, sand.scene.heights_m)


def test_mask_shows_the_commanded_patch_of_the_soil_as_the_depth_of_the_picture_does(seeing_env):
    mask = mask_of(seeing_env.reset(seed=2)[0])
    points_w = seeing_env.renderer.terrain_points_w()
    assert np.array_equal(mask, seeing_env.target.contains(points_w))
    # Where nothing stands before the patch, the picture's own depth tells the same.
    assert seeing_env.target.contains(seeing_env.camera.points_w(seeing_env.depth_m()))[mask].all()
    center_w = np.nanmean(points_w[mask], axis=0)
    assert np.hypot(*(center_w - seeing_env.target.center_w)[:2]) < 0.25


def test_all_targets_of_a_scene_are_seen_and_paired_resets_differ_in_the_mask_only(seeing_env):
    starts = [seeing_env.reset(options={"scene_id": 9, "target_id": target_id})[0] for target_id in range(4)]
    masks = [mask_of(start) for start in starts]
    assert min(mask.sum() for mask in masks) >= 50
    assert len({mask.tobytes() for mask in masks}) == 4
    for start in starts[1:]:
        assert np.array_equal(start["agent_pos"], starts[0]["agent_pos"])
        for camera in ("main", "cab"):
            assert np.array_equal(start["pixels"][camera], starts[0]["pixels"][camera])


def test_a_new_command_shows_its_patch_on_the_soil_as_it_lies_then(seeing_env):
    seeing_env.reset(options={"scene_id": 2, "target_id": 0, "commands": [(3, 2)]})
    dig = np.array([-1.0, -0.5, 0.0, 0.0])
    rollout(seeing_env, dig, 2)
    state = seeing_env.cycle.state
    far_m = state.distance_to_target_m
    observation, *_, info = seeing_env.step(dig)
    assert info["target_id"] == seeing_env.cycle.target_id == 2
    target, points_w = seeing_env.scene.targets[2], seeing_env.renderer.terrain_points_w()
    assert np.array_equal(mask_of(observation), target.contains(points_w))
    new_m = np.linalg.norm(seeing_env.worksite.machine.cutting_edge_pos_w - target.center_w)
    assert state.distance_to_target_m == pytest.approx(new_m)
    assert abs(new_m - far_m) > 0.05


def test_the_operator_follows_a_new_command_before_it_digs(env):
    env.reset(options={"scene_id": 1, "target_id": 0, "commands": [(5, 3)]})
    metrics = operate(env)[2]["episode_metrics"]
    assert metrics["commands"] == [[0, 0], [5, 3]]
    assert metrics["is_success"]


def test_the_main_view_is_drawn_once_per_frame(monkeypatch):
    env = ExcavatorEnv()
    drawn = []
    render = env.renderer.render
    monkeypatch.setattr(env.renderer, "render", lambda camera: (drawn.append(camera), render(camera))[1])
    env.reset(seed=2)
    env.picture()[...] = 0
    assert drawn.count("main") == 1
    assert np.array_equal(env.picture(), render("main"))
    for _ in range(5):
        observation = env.step(np.array([1.0, 0.5, 0.0, 0.0]))[0]
    assert np.array_equal(env.picture(), observation["pixels"]["main"])
    assert drawn.count("main") == 6
    env.close()


def test_successful_cycle_pays_its_soil_and_one_for_success(env):
    env.reset(options={"scene_id": 0, "target_id": 0})
    total, terminated, info = operate(env)
    metrics = info["episode_metrics"]
    assert terminated
    assert metrics["is_success"] is info["is_success"] is True
    assert total == pytest.approx(metrics["retained_mass_kg"] / FULL_BUCKET_KG + 1.0)


def test_the_caption_tells_load_and_deposit(env):
    env.reset(options={"scene_id": 0, "target_id": 0})
    state = env.cycle.state
    state.bucket_mass_kg, state.deposited_mass_kg = 312.4, 95.6
    words = env.caption.words
    assert words[:2] == ("load 312 kg", "in the box 96 kg")
    assert "0.0 s" in words


@pytest.mark.parametrize(
    ("hit", "contacts", "deposited", "failure"),
    [
        (None, 0, 0.0, None),
        (True, 0, 0.0, None),
        (False, 0, 0.0, "missed region"),
        (True, 1, 300.0, "hit the box"),
    ],
)
def test_a_failure_is_told_as_soon_as_it_is_certain(env, hit, contacts, deposited, failure):
    env.reset(options={"scene_id": 0, "target_id": 0})
    env.cycle.target_hit = hit
    env.cycle.state.hard_target_contacts, env.cycle.state.deposited_mass_kg = contacts, deposited
    assert env.caption.outcome == failure


@pytest.mark.slow
def test_another_region_is_commanded_at_the_retarget_frame_and_the_operator_digs_it():
    env = ExcavatorEnv(obs_type="agent_pos", fidelity="fast", retarget_frame=15)
    second = {}
    for scene_id, target_id in ((0, 0), (1, 2), (2, 3)):
        env.reset(options={"scene_id": scene_id, "target_id": target_id})
        _, is_over, info = operate(env)
        (start, first), (frame, second[scene_id]) = info["episode_metrics"]["commands"]
        assert (start, first, frame) == (0, target_id, 15)
        assert second[scene_id] != target_id
        assert is_over
        assert info["is_success"]
    env.reset(options={"scene_id": 1, "target_id": 2})
    assert rollout(env, np.zeros(4), 15)[4]["target_id"] == second[1]  # whatever was done before
