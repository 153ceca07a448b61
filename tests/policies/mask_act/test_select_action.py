import pytest
import torch

from lerobot_excav.errors import ConfigurationError

from .conftest import MAIN, MASK


@pytest.fixture
def counted(awake, monkeypatch):
    """A policy that writes down how many environments each plan was made for."""

    def build(**settings):
        agent = awake(**settings)
        plan, sizes = agent.predict_action_chunk, []

        def counting(batch, **kwargs):
            sizes.append(batch[MAIN].shape[0])
            return plan(batch, **kwargs)

        monkeypatch.setattr(agent, "predict_action_chunk", counting)
        return agent, sizes

    return build


@pytest.mark.parametrize(("n_action_steps", "plans"), [(8, 1), (2, 4)])
def test_a_plan_is_executed_in_order_and_replaced_when_it_has_run_out(counted, batch, n_action_steps, plans):
    agent, sizes = counted(n_action_steps=n_action_steps)
    observation = batch()
    plan = agent.predict_action_chunk(observation)[:, :n_action_steps]
    sizes.clear()
    actions = torch.stack([agent.select_action(observation) for _ in range(8)], dim=1)
    torch.testing.assert_close(actions, plan.repeat(1, plans, 1), rtol=0, atol=0)
    assert sizes == [3] * plans


def test_a_new_mask_drops_only_the_plan_of_its_environment(counted, batch, mask):
    agent, sizes = counted()
    first, second = batch(seed=1), batch(seed=2)
    old_plan = agent.predict_action_chunk(first)
    for _ in range(3):
        agent.select_action(first)
    second[MASK][1] = mask(1, top=0, left=0)[0]
    new_plan = agent.predict_action_chunk(second)
    sizes.clear()
    actions = torch.stack([agent.select_action(second) for _ in range(5)], dim=1)
    torch.testing.assert_close(actions[[0, 2]], old_plan[[0, 2], 3:8], rtol=0, atol=0)
    torch.testing.assert_close(actions[1], new_plan[1, :5], rtol=1e-5, atol=1e-5)
    assert sizes == [1]
    assert (new_plan[1] - old_plan[1]).abs().max() > 1e-3
    # The two old plans run out now, the new one has three actions left.
    agent.select_action(second)
    assert sizes == [1, 2]


def test_a_new_mask_restarts_only_the_ensemble_of_its_environment(awake, batch, mask):
    changed, steady = (awake(temporal_ensemble_coeff=0.01) for _ in range(2))
    for seed in range(3):
        changed.select_action(batch(seed=seed))
        steady.select_action(batch(seed=seed))
    observation = batch(seed=3)
    observation[MASK][1] = mask(1, top=0, left=0)[0]
    action, expected = changed.select_action(observation), steady.select_action(batch(seed=3))
    torch.testing.assert_close(action[[0, 2]], expected[[0, 2]])
    torch.testing.assert_close(action[1], changed.predict_action_chunk(observation)[1, 0])
    assert not torch.allclose(action[1], expected[1], atol=1e-4)


def test_a_withheld_mask_changes_no_plan_and_the_observation_is_left_alone(counted, batch, mask):
    agent, sizes = counted(withhold_mask=True)
    agent.select_action(batch())
    observation = {**batch(), MASK: mask(3, top=0, left=0)}
    copy = {key: value.clone() for key, value in observation.items()}
    agent.select_action(observation)
    assert sizes == [3]
    assert observation.keys() == copy.keys()
    assert all(torch.equal(observation[key], copy[key]) for key in copy)


@pytest.mark.parametrize("settings", [{}, {"temporal_ensemble_coeff": 0.01}])
def test_reset_forgets_plans_and_admits_another_batch_size(awake, batch, settings):
    agent = awake(**settings)
    agent.select_action(batch(3))
    with pytest.raises(ConfigurationError, match=r"policy\.reset\(\)"):
        agent.select_action(batch(2))
    agent.reset()
    observation = batch(2, seed=7)
    expected = agent.predict_action_chunk(observation)[:, 0]
    torch.testing.assert_close(agent.select_action(observation), expected)


@pytest.mark.parametrize("settings", [{}, {"temporal_ensemble_coeff": 0.01}])
def test_a_plan_may_start_in_inference_mode_and_be_continued_and_replaced_outside(awake, batch, mask, settings):
    agent = awake(**settings)
    with torch.inference_mode():
        agent.select_action(batch())
    agent.select_action(batch())
    assert torch.isfinite(agent.select_action({**batch(), MASK: mask(3, top=0, left=0)})).all()


def test_a_mask_that_is_not_binary_is_refused_even_while_a_plan_lasts(awake, batch):
    agent, observation = awake(), batch()
    agent.select_action(observation)
    observation[MASK] *= 0.9
    for act in (agent.select_action, agent.predict_action_chunk):
        with pytest.raises(ConfigurationError, match="not binary"):
            act(observation)


@pytest.mark.parametrize("settings", [{}, {"temporal_ensemble_coeff": 0.01}])
def test_actions_are_float32_where_autocast_computes_in_bfloat16(awake, batch, settings):
    agent, observation = awake(**settings), batch()
    with torch.autocast("cpu", torch.bfloat16):
        actions = [agent.select_action(observation), agent.predict_action_chunk(observation)]
    # The plan lasts, and another one follows, without it; and the other way round.
    actions.append(agent.select_action(observation))
    other = {**observation, MASK: observation[MASK].flip(-1)}
    actions.append(agent.select_action(other))
    with torch.autocast("cpu", torch.bfloat16):
        actions += [agent.select_action(other), agent.select_action(observation)]
    assert {action.dtype for action in actions} == {torch.float32}
    assert all(torch.isfinite(action).all() for action in actions)


QUEUES_OF_UPSTREAM = ("_queues", "_action_queue")


def drop_queued_actions(policy):
    """What LeRobot's main branch does, in a method of every policy, when an instruction changes."""
    for name in QUEUES_OF_UPSTREAM:
        queue = getattr(policy, name, None)
        if isinstance(queue, dict):
            queue["action"].clear()
        elif queue is not None:
            queue.clear()


def queued_action_count(policy):
    """What it asks to know whether the next action comes from a new plan."""
    return max(len(getattr(policy, name, ())) for name in QUEUES_OF_UPSTREAM)


@pytest.mark.parametrize(("settings", "left"), [({}, 7), ({"temporal_ensemble_coeff": 0.01}, 0)])
def test_lerobots_drop_queued_actions_makes_a_new_plan(counted, batch, settings, left):
    agent, sizes = counted(**settings)
    agent.select_action(batch(seed=1))
    assert queued_action_count(agent) == left
    drop_queued_actions(agent)
    assert queued_action_count(agent) == 0
    sizes.clear()
    observation = batch(seed=2)
    action = agent.select_action(observation)
    assert sizes == [3]
    torch.testing.assert_close(action, agent.predict_action_chunk(observation)[:, 0])
