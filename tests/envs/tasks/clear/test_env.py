"""Clear-v0: cycles on one pile, and what is told of them."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.tasks.clear import clearing as clearing_module
from lerobot_excav.envs.tasks.clear import env as env_module
from lerobot_excav.envs.tasks.clear.cycle_record import FAILURES, failure_of
from lerobot_excav.envs.tasks.clear.env import ClearEnv
from lerobot_excav.envs.tasks.clear.measures import ClearRecord, clear_outcome
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.missing_soil import missing_soil
from lerobot_excav.envs.tasks.scoop.operator import DigOperator
from lerobot_excav.envs.tasks.scoop.spec import TASK_STATE_NAMES
from lerobot_excav.errors import ConfigurationError

STILL = np.zeros(4, np.float32)
CHEAP = {"fidelity": "fast", "obs_type": "agent_pos", "render_mode": None}
ALL_OVER = "-3,-3,3,3"


@pytest.fixture(scope="module")
def env():
    env = ClearEnv(**CHEAP)
    yield env
    env.close()


@pytest.fixture
def short_cycles(monkeypatch):
    """Give up cycles after 1 s, and episodes after three."""
    monkeypatch.setattr(clearing_module, "CYCLE_LIMIT_S", 1.0)
    monkeypatch.setattr(env_module, "CYCLES", 3)


@pytest.fixture(scope="module")
def cleared():
    """Two cycles of the scripted operator: the environment at the end, the last info and the sum of rewards."""
    env = ClearEnv(**CHEAP, scene_set="val")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(env_module, "CYCLES", 2)
        env.reset(options={"scene_id": 0})
        operator = DigOperator(rng=np.random.default_rng(0))
        operator.reset(env)
        total, is_over = 0.0, False
        while not is_over:
            _, reward, terminated, truncated, info = env.step(operator.act(env))
            total, is_over = total + reward, terminated or truncated
        yield env, info, total, terminated
    env.close()


def play(env, frames, action=STILL):
    return [env.step(action) for _ in range(frames)]


# Cycles.


@pytest.mark.usefixtures("short_cycles")
def test_cycles_that_bring_nothing_time_out_and_the_episode_ends_after_the_last(env):
    env.reset(options={"scene_id": 3})
    steps = play(env, 30)
    assert [terminated for _, _, terminated, _, _ in steps] == [False] * 29 + [True]
    metrics = steps[-1][4]["episode_metrics"]
    assert metrics["commands"] == [[0, 0], [10, 0], [20, 0]]
    assert [info["command_frame"] for *_, info in steps] == [0] * 9 + [10] * 10 + [20] * 11
    assert [cycle["end"] for cycle in metrics["cycles"]] == ["time-out"] * 3
    assert [cycle["failure"] for cycle in metrics["cycles"]] == ["no soil"] * 3
    assert [(event["event"], event["time_s"]) for event in metrics["events"]] == [
        ("time-out", 1.0),
        ("time-out", 2.0),
        ("time-out", 3.0),
    ]
    assert metrics["pile_removed"] == pytest.approx(0.0, abs=1e-6)
    assert metrics["is_success"] is False


@pytest.mark.usefixtures("short_cycles")
def test_a_region_that_brought_nothing_is_not_commanded_in_the_next_cycle(env):
    env.reset(options={"scene_id": 3})
    cycles = play(env, 30)[-1][4]["episode_metrics"]["cycles"]
    first_w, second_w, third_w = (np.array(cycle["region_w"])[:2] for cycle in cycles)
    assert min(np.hypot(*(second_w - first_w)), np.hypot(*(third_w - first_w)), np.hypot(*(third_w - second_w))) >= 0.8
    assert [cycle["reason"]["vain_tries"] for cycle in cycles] == [0, 0, 0]


def test_a_time_limit_within_a_cycle_leaves_it_unfinished():
    env = ClearEnv(**CHEAP, episode_length=3)
    env.reset(seed=1)
    *_, terminated, truncated, info = play(env, 3)[-1]
    assert (terminated, truncated) == (False, True)
    (cycle,) = info["episode_metrics"]["cycles"]
    assert (cycle["end"], cycle["duration_s"]) == ("unfinished", pytest.approx(0.3))
    env.close()


def test_an_episode_lasts_20_cycles_of_25_s_at_most(env):
    assert env.episode_length == 20 * 25 * 10


def test_operator_clears_cycle_by_cycle_and_every_part_is_told(cleared):
    env, info, total, terminated = cleared
    metrics = info["episode_metrics"]
    record = ClearRecord.model_validate_json(json.dumps(metrics))
    assert terminated
    assert [cycle.end for cycle in record.cycles] == ["dump", "dump"]
    assert [cycle.failure for cycle in record.cycles] == ["none", "none"]
    assert [event.event for event in record.events if event.event != "full"] == ["onset", "dump"] * 2
    assert (record.target_success_percent, record.complete_percent, record.spill_percent) == (100.0, 100.0, 0.0)
    ledger_kg = env.worksite.soil.ledger_kg()
    boxed_kg = ledger_kg["box"]
    assert record.retained_mass_kg == pytest.approx(boxed_kg, abs=0.1)
    assert total == pytest.approx(boxed_kg / 485.0)
    start_kg = env.worksite.start_heights_m.sum() * 0.05**2 * env.worksite.soil.parameters.density_kg_m3
    # What is gone from the dig area lies in the box, hangs in the bucket or has rolled away.
    gone_kg = boxed_kg + ledger_kg["bucket"] + ledger_kg["out_of_bounds"]
    assert record.pile_removed * start_kg == pytest.approx(gone_kg, abs=1.0)
    assert record.cycles[-1].pile_removed == pytest.approx(record.pile_removed, abs=1e-4)


def test_what_was_done_is_told_beside_what_was_commanded(cleared):
    first, second = (ClearRecord.model_validate_json(json.dumps(cleared[1]["episode_metrics"]))).cycles
    assert np.hypot(*np.subtract(first.region_w, second.region_w)[:2]) > 0.5
    for cycle in (first, second):
        assert np.hypot(*np.subtract(cycle.onset_w, cycle.region_w)[:2]) < 0.57  # within the patch
        # The cut leads from the region towards the machine, at x = -4.6 m.
        assert cycle.exit_w[0] < cycle.source_w[0] < cycle.region_w[0] + 0.1
        assert 0.2 < cycle.depth_m < 1.2


def test_soil_that_still_falls_into_the_box_is_no_dump_of_the_next_cycle(env, monkeypatch):
    monkeypatch.setattr(clearing_module, "CYCLE_LIMIT_S", 3.0)
    env.reset(options={"scene_id": 3})
    places = np.stack(np.meshgrid([-0.4, -0.2, 0.0, 0.2, 0.4], [-0.3, 0.0, 0.3], [1.2, 1.4], indexing="ij"), axis=-1)
    over_box_w = np.asarray(TARGET_BOX.center_w) + places.reshape(-1, 3)
    env.worksite.soil.add_parcels(over_box_w, np.zeros_like(over_box_w))
    play(env, 30)
    (record,) = env.clearing.records
    assert record.retained_mass_kg > 20.0
    assert (record.end, record.failure) == ("time-out", "no soil")


def test_hard_contacts_of_a_cycle_that_loaded_nothing_are_summed():
    names = TASK_STATE_NAMES
    states = np.zeros((4, len(names)), np.float32)
    states[1, names.index("hard_target_contacts")] = 1
    states[3, names.index("spill_before_target_events")] = 1
    outcome = clear_outcome(states)
    assert (outcome["hard_target_contacts"], outcome["spill_before_target_events"]) == (1, 1)


def test_an_episode_may_begin_after_some_cycles_and_its_pile_is_what_is_left_then(env):
    env.reset(options={"scene_id": 3})
    whole_kg, first_w = env.clearing.left_kg, env.target.center_w
    env.reset(options={"scene_id": 3, "stage": 1})
    assert whole_kg - env.clearing.left_kg > 100.0
    assert env.clearing.pile_removed == 0.0
    assert not np.array_equal(env.target.center_w, first_w)


def test_planner_never_looks_at_the_soil(env, monkeypatch):
    env.reset(options={"scene_id": 2})
    places = [proposal.target.center_w for proposal in env.plan.proposals]
    soil = env.worksite.soil

    def blind(*_):
        raise AssertionError("the planner looked at the soil")

    depth_m = env._planner_renderer.depth_m("main")
    monkeypatch.setattr(env._planner_renderer, "depth_m", lambda camera: depth_m)
    monkeypatch.setattr(type(soil), "heights_m", property(blind))
    monkeypatch.setattr(type(soil), "height_at", blind)
    env._look()
    assert np.array_equal([proposal.target.center_w for proposal in env.plan.proposals], places)


# Commands.


def test_the_planners_own_choice_comes_first_whatever_the_seed_and_others_can_be_asked_for(env):
    for seed in (0, 3):
        assert env.reset(seed=seed)[1]["target_id"] == 0
        assert env.target is env.plan.proposals[0].target
    env.reset(options={"scene_id": 3, "target_id": 1})
    assert env.target is env.plan.proposals[1].target
    assert [command.target_id for command in env.other_commands()] == [0, *range(2, len(env.plan.proposals))]


@pytest.mark.usefixtures("short_cycles")
def test_a_schedule_changes_the_command_within_a_cycle_and_the_task_goes_on_by_itself(env):
    env.reset(options={"scene_id": 3, "commands": [(5, 1), (10, 2)]})
    play(env, 22)
    assert [(c.since_frame, c.target_id) for c in env.commands] == [(0, 0), (5, 1), (10, 2), (20, 0)]
    assert env.clearing.records[0].target_id == 1


@pytest.mark.usefixtures("short_cycles")
def test_commands_and_actions_played_again_give_the_same_bits(env):
    rng = np.random.default_rng(1)
    actions = rng.uniform(-1.0, 1.0, (29, 4)).astype(np.float32)
    env.reset(options={"scene_id": 5})
    first = [env.step(action) for action in actions]
    commands = env.commands
    again = ClearEnv(**CHEAP)
    again.reset(options={"scene_id": 5, "commands": [(c.since_frame, c.target_id) for c in commands[1:]]})
    second = [again.step(action) for action in actions]
    for one, other in zip(first, second, strict=True):
        assert np.array_equal(one[0]["agent_pos"], other[0]["agent_pos"])
        assert np.array_equal(one[4]["task_state"], other[4]["task_state"])
    assert [tuple(c.region.center_w) for c in again.commands] == [tuple(c.region.center_w) for c in commands]
    again.close()


@pytest.mark.usefixtures("short_cycles")
def test_the_mask_changes_with_the_cycle_and_shows_the_planned_region():
    env = ClearEnv(fidelity="fast", scene_set="val")
    env.reset(options={"scene_id": 0})
    assert np.array_equal(env.mask.pixels, env.true_mask(env.command))
    soil = env.worksite.soil
    lowered = soil.heights_m.copy()
    x_w, y_w = np.meshgrid(soil.x_w, soil.y_w, indexing="ij")
    lowered[env.target.contains(np.stack([x_w, y_w], axis=-1))] = 0.0
    soil.reset(lowered)
    before = env.mask.pixels
    observation = play(env, 10)[-1][0]
    assert env.command.since_frame == 10
    shown = observation["pixels"]["target_mask"][..., 0] > 0
    assert np.array_equal(shown, env.mask.pixels)
    assert not np.array_equal(shown, before)
    assert np.array_equal(shown, env.true_mask(env.command))
    assert (env.score_picture() != env.picture()).any()
    env.close()


@pytest.mark.parametrize("condition", ["random", "mismatched"])
def test_a_wrong_mask_is_wrong_also_where_only_one_region_is_left(condition, monkeypatch):
    env = ClearEnv(fidelity="fast", mask_condition=condition)
    plan_targets = env_module.plan_targets

    def plan_one(*arguments):
        plan = plan_targets(*arguments)
        return env_module.replace(plan, proposals=plan.proposals[:1])

    for plan in (plan_targets, plan_one):
        monkeypatch.setattr(env_module, "plan_targets", plan)
        env.reset(options={"scene_id": 1})
        shown, right = env.mask.pixels, env.true_mask(env.command)
        assert shown.any()
        assert (shown & right).sum() < 0.5 * right.sum()
    with pytest.raises(ConfigurationError, match=r"target_id=1 .*the planner proposes 1 regions here"):
        env.reset(options={"scene_id": 1, "target_id": 1})
    env.close()


def test_keep_out_zones_move_the_command_and_leave_nothing_where_they_are_all_over():
    env = ClearEnv(**CHEAP)
    env.reset(options={"scene_id": 1})
    x, y = env.target.center_w[:2]
    env.close()
    zoned = ClearEnv(**CHEAP, keep_out=f"{x - 0.1},{y - 0.1},{x + 0.1},{y + 0.1}")
    zoned.reset(options={"scene_id": 1})
    assert np.hypot(zoned.target.center_w[0] - x, zoned.target.center_w[1] - y) > 0.3
    zoned.close()
    barred = ClearEnv(**CHEAP, keep_out=ALL_OVER)
    with pytest.raises(ConfigurationError, match=r"nothing to dig: .* barred by keep_out.*keep_out='-3,-3,3,3'"):
        barred.reset(options={"scene_id": 1})
    with pytest.raises(ConfigurationError, match="no episode yet; call reset"):  # not an error of another kind
        barred.step(np.zeros(4, np.float32))
    barred.close()


def test_an_environment_that_does_not_play_a_task_says_which_does():
    with pytest.raises(ConfigurationError, match=r"task='Clear-v0' is not played by ExcavatorEnv; make it by gymn"):
        ExcavatorEnv(task="Clear-v0", **CHEAP)


def swing_after_a_dump(between_cycles):
    """Let the operator dump, then push the swing stick; return way [rad] and speed [rad/s] at the next command."""
    env = ClearEnv(**CHEAP, scene_set="val", between_cycles=between_cycles)
    env.reset(options={"scene_id": 0})
    operator = DigOperator(rng=np.random.default_rng(0))
    operator.reset(env)
    while not env.clearing.is_dumped:
        env.step(operator.act(env))
    begin, first = env.worksite.machine.joint_pos[0], env.command.since_frame
    frames = 0
    while env.command.since_frame == first:
        env.step(np.array([1.0, 0.0, 0.0, 0.0], np.float32))
        frames += 1
    way_rad, speed_rad_s = env.worksite.machine.joint_pos[0] - begin, env.worksite.machine.joint_vel[0]
    env.step(np.array([1.0, 0.0, 0.0, 0.0], np.float32))
    obeys_again = env.worksite.machine.joint_vel[0] > speed_rad_s + 0.01
    assert env.clearing.records[0].end == "dump"
    env.close()
    return frames, abs(way_rad), abs(speed_rad_s), obeys_again


def test_a_machine_that_stands_between_cycles_moves_again_with_the_next_command():
    frames, way_rad, speed_rad_s, _ = swing_after_a_dump("obey")
    assert frames >= 5
    assert way_rad > 0.1
    assert speed_rad_s > 0.3
    frames, way_rad, speed_rad_s, obeys_again = swing_after_a_dump("stand")
    assert frames >= 5
    assert way_rad < 0.02
    assert speed_rad_s < 0.01
    assert obeys_again


def test_between_cycles_means_nothing_to_a_single_scoop():
    with pytest.raises(ConfigurationError, match=r"between_cycles='stand' has no effect with task='Scoop-v0'"):
        ExcavatorEnv(between_cycles="stand", **CHEAP)


def test_zones_mean_nothing_to_a_single_scoop():
    with pytest.raises(ConfigurationError, match=r"keep_out='-3,-3,3,3' has no effect with task='Scoop-v0'"):
        ExcavatorEnv(keep_out=ALL_OVER, **CHEAP)


# Records.


def cycle_of(*, onset=(1.0, 0.0), region=(1.0, 0.0), hit=True, **state):
    state = {"hard_target_contacts": 0, "spill_before_target_events": 0, "bucket_mass_kg": 0.0, **state}
    return SimpleNamespace(
        onset_w=None if onset is None else np.array([*onset, 0.2]),
        target=SimpleNamespace(center_w=np.array([*region, 0.2])),
        target_hit=hit,
        state=SimpleNamespace(**state),
    )


@pytest.mark.parametrize(
    ("cycle", "end", "failure"),
    [
        (cycle_of(), "dump", "none"),
        (cycle_of(onset=None), "time-out", "no soil"),
        (cycle_of(hard_target_contacts=1, spill_before_target_events=1), "dump", "hard contact"),
        (cycle_of(spill_before_target_events=1, hit=False), "dump", "spill before target"),
        (cycle_of(), "spill", "spill before target"),
        (cycle_of(hit=False, onset=(2.9, 0.0)), "dump", "missed region"),
        (cycle_of(hit=False, onset=(0.1, 0.1)), "dump", "repeated default scoop"),
        (cycle_of(hit=False, onset=(0.1, 0.1), region=(0.2, 1.9)), "dump", "missed region"),
        (cycle_of(bucket_mass_kg=60.0), "time-out", "incomplete dump"),
        (cycle_of(), "time-out", "incomplete dump"),
    ],
)
def test_a_failure_has_the_first_category_that_applies(cycle, end, failure):
    last = SimpleNamespace(onset_w=(0.0, 0.0, 0.3), region_w=(0.0, 2.0, 0.3))
    assert failure_of(cycle, end, last) == failure
    assert failure in (*FAILURES, "none")


def test_soil_is_missing_where_the_ground_is_lower():
    x_w = y_w = np.array([-1.0, 0.0, 1.0])
    before = np.full((3, 3), 0.5)
    after = before.copy()
    after[2, 1], after[0, 0] = 0.2, 0.7  # dug at x = 1 m, spilled at x = -1 m
    assert missing_soil(before, after, x_w, y_w) == ((1.0, 0.0), pytest.approx(0.3))
    assert missing_soil(before, before, x_w, y_w) == (None, None)


def test_the_outcome_of_a_dataset_adds_up_the_cycles():
    states = np.zeros((6, 8), np.float32)
    states[:, 1] = [100, 400, 410, 0, 300, 320]  # taken up; the second cycle begins at the fourth frame
    states[:, 2] = [0, 0, 390, 0, 0, 310]  # brought into the box
    states[:, 7] = [0, 1, 1, 0, 0, 2]
    outcome = clear_outcome(states)
    assert (outcome["retained_mass_kg"], outcome["excavated_mass_kg"]) == (700.0, 730.0)
    assert outcome["spill_before_target_events"] == 3
