"""The last mask is used where the next ones are empty."""

import logging

import torch
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.policies.mask_act.held_mask import HeldMask

from .conftest import MASK

SHOWN = st.lists(st.lists(st.sampled_from([0, 0, 0, 1, 2]), min_size=2, max_size=2), min_size=1, max_size=20)


@given(SHOWN, st.integers(0, 4))
def test_masks_equal_those_of_one_environment_at_a_time(shown, most_frames):
    """Masks of one pixel, whose value says which one it is; 0 is an empty one."""
    held, last, empty = HeldMask(most_frames), [0, 0], [0, 0]
    for numbers in shown:
        expected = []
        for environment, number in enumerate(numbers):
            empty[environment] = 0 if number else empty[environment] + 1
            last[environment] = number or last[environment]
            expected.append(last[environment] if empty[environment] <= most_frames else 0)
        assert held.filled(torch.tensor(numbers).reshape(2, 1, 1, 1).float()).flatten().tolist() == expected


def without_mask(observation):
    return {**observation, MASK: torch.zeros_like(observation[MASK])}


def play(agent, observation, steps):
    return torch.cat([agent.select_action(observation) for _ in range(steps)])


def test_a_policy_acts_through_a_gap_as_if_there_were_none(awake, batch):
    seen, gaps = batch(batch_size=1), []
    for has_gap in (False, True):
        agent = awake(n_action_steps=4)
        there = play(agent, seen, 3)
        gaps.append(torch.cat([there, play(agent, without_mask(seen) if has_gap else seen, 6), play(agent, seen, 3)]))
    torch.testing.assert_close(*gaps, rtol=0, atol=0)


def test_a_policy_that_holds_nothing_plans_for_the_empty_mask(awake, batch):
    agent, seen = awake(n_action_steps=4, hold_mask_frames=0), batch(batch_size=1)
    play(agent, seen, 3)
    plan = agent.predict_action_chunk(without_mask(seen))
    torch.testing.assert_close(play(agent, without_mask(seen), 2), plan[0, :2], rtol=1e-5, atol=1e-5)


def test_a_target_that_stays_away_is_said_once_and_no_longer_held(awake, batch, caplog):
    agent, seen = awake(n_action_steps=4, hold_mask_frames=3), batch(batch_size=1)
    play(agent, seen, 1)
    with caplog.at_level(logging.WARNING):
        play(agent, without_mask(seen), 3)
        assert not caplog.records
        lost = play(agent, without_mask(seen), 2)
        play(agent, seen, 1)
        play(agent, without_mask(seen), 9)
    assert [record.message.split(":")[0] for record in caplog.records] == [
        "The target mask has been empty for 4 frames in a row"
    ]
    torch.testing.assert_close(lost, agent.predict_action_chunk(without_mask(seen))[0, :2], rtol=1e-5, atol=1e-5)


def test_a_mask_that_is_empty_from_the_first_frame_is_passed_on_without_a_warning(awake, batch, caplog):
    """A question that is asked on purpose, `mask_condition=zero`."""
    agent, blind = awake(n_action_steps=4, hold_mask_frames=2), without_mask(batch(batch_size=1))
    with caplog.at_level(logging.WARNING):
        played = play(agent, blind, 4)
    torch.testing.assert_close(played, agent.predict_action_chunk(blind)[0, :4], rtol=1e-5, atol=1e-5)
    assert not caplog.records


def test_after_a_reset_no_mask_of_the_last_rollout_is_held(awake, batch):
    agent, seen = awake(n_action_steps=4), batch(batch_size=1)
    play(agent, seen, 3)
    agent.reset()
    blind = without_mask(seen)
    torch.testing.assert_close(play(agent, blind, 4), agent.predict_action_chunk(blind)[0, :4], rtol=1e-5, atol=1e-5)


def test_a_policy_that_holds_masks_can_be_asked_to_act_without_any(policy, batch):
    """Its checkpoint says how masks are held and compared, and `--policy.withhold_mask=true` is given beside."""
    settings, seen = {"withhold_mask": True, "n_action_steps": 4}, batch(batch_size=1)
    plain, steady = policy(**settings), policy(**settings, hold_mask_frames=5, replan_iou=0.5)
    torch.testing.assert_close(play(steady, seen, 6), play(plain, seen, 6), rtol=0, atol=0)


def test_the_way_back_does_not_begin_again_after_a_gap_of_the_mask(awake, batch):
    seen, played = batch(batch_size=2), []
    for has_gap in (False, True):
        agent = awake(n_action_steps=4, backtrack_frames=20)
        gap = {**seen, MASK: seen[MASK] * torch.tensor([1.0, 0.0 if has_gap else 1.0])[:, None, None, None]}
        played.append(torch.cat([play(agent, seen, 7), play(agent, gap, 3), play(agent, seen, 3)]))
    torch.testing.assert_close(*played, rtol=0, atol=0)
