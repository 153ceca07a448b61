"""A policy that goes back the way it came when another target is shown, environment by environment."""

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.way_back import STILL_FRAMES, WayBack

from .conftest import MASK


def shown(batch, mask, *places, size=12):
    """A batch whose environments show squares at these places."""
    observation = batch(batch_size=len(places))
    for number, (top, left) in enumerate(places):
        observation[MASK][number] = mask(1, top=top, left=left, size=size)[0]
    return observation


FIRST, OTHER, THIRD = (8, 16), (18, 34), (0, 0)


def play(agent, observation, steps):
    return torch.stack([agent.select_action(observation) for _ in range(steps)], dim=1)


def test_another_target_is_answered_by_the_way_back_and_then_by_a_plan_from_there(awake, batch, mask):
    agent = awake(backtrack_frames=20, n_action_steps=4)
    there = play(agent, shown(batch, mask, FIRST, FIRST), 7)
    turned = shown(batch, mask, FIRST, OTHER)
    back = play(agent, turned, 7)
    torch.testing.assert_close(back[1], there[1].flip(0), rtol=0, atol=0)
    plan = agent.predict_action_chunk(turned)
    after = play(agent, turned, 4)
    torch.testing.assert_close(after[1], plan[1, :4], rtol=1e-5, atol=1e-5)


def test_whoever_keeps_its_target_is_not_touched_by_others(awake, batch, mask):
    turning, steady = (awake(backtrack_frames=20 * is_on, n_action_steps=4) for is_on in (True, False))
    kept = []
    for agent, second in ((turning, OTHER), (steady, FIRST)):
        play(agent, shown(batch, mask, FIRST, FIRST), 7)
        kept.append(play(agent, shown(batch, mask, FIRST, second), 9)[0])
    torch.testing.assert_close(*kept, rtol=1e-5, atol=1e-5)


def test_a_target_that_changes_again_on_the_way_back_is_looked_at_at_its_end(awake, batch, mask):
    agent = awake(backtrack_frames=20, n_action_steps=4)
    there = play(agent, shown(batch, mask, FIRST), 7)
    back = torch.cat([play(agent, shown(batch, mask, OTHER), 2), play(agent, shown(batch, mask, THIRD), 5)], dim=1)
    torch.testing.assert_close(back[0], there[0].flip(0), rtol=0, atol=0)
    last = shown(batch, mask, THIRD)
    plan = agent.predict_action_chunk(last)
    torch.testing.assert_close(play(agent, last, 4)[0], plan[0, :4], rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("moved", [(8, 20), (14, 16)])
def test_a_mask_that_only_moves_is_the_same_target(awake, batch, mask, moved):
    agents = [awake(backtrack_frames=20 * is_on, n_action_steps=4) for is_on in (True, False)]
    actions = []
    for agent in agents:
        play(agent, shown(batch, mask, FIRST), 3)
        actions.append(play(agent, shown(batch, mask, moved), 6))
    torch.testing.assert_close(*actions, rtol=0, atol=0)


def test_after_a_reset_there_is_no_way_to_go_back(awake, batch, mask):
    agent = awake(backtrack_frames=20, n_action_steps=4)
    play(agent, shown(batch, mask, FIRST), 7)
    agent.reset()
    turned = shown(batch, mask, OTHER)
    plan = agent.predict_action_chunk(turned)
    torch.testing.assert_close(play(agent, turned, 4)[0], plan[0, :4], rtol=1e-5, atol=1e-5)


def test_plans_that_are_dropped_with_the_command_leave_the_way_back(awake, batch, mask):
    """LeRobot drops them when an instruction changes, which is the change of mind."""
    agent = awake(backtrack_frames=20, n_action_steps=4)
    there = play(agent, shown(batch, mask, FIRST), 7)
    agent._action_queue.clear()
    back = play(agent, shown(batch, mask, OTHER), 7)
    torch.testing.assert_close(back[0], there[0].flip(0), rtol=0, atol=0)


def test_a_mask_that_jitters_beside_itself_is_answered_as_without_a_way_back(awake, batch, mask):
    agents = [awake(backtrack_frames=frames, n_action_steps=4) for frames in (50, 0)]
    played = []
    for agent in agents:
        places = [FIRST if number % 3 else OTHER for number in range(20)]
        played.append(torch.cat([play(agent, shown(batch, mask, place), 1) for place in places], dim=1))
    torch.testing.assert_close(*played, rtol=0, atol=0)


@pytest.mark.parametrize(
    ("settings", "why"),
    [
        ({"backtrack_stride": 3}, "backtrack_stride=3 has no effect with backtrack_frames=0"),
        ({"backtrack_frames": 9, "withhold_mask": True}, "has no effect with withhold_mask=True"),
    ],
)
def test_settings_of_the_way_back_without_effect_are_refused(config, settings, why):
    with pytest.raises(ConfigurationError, match=why):
        config(**settings)


def test_an_ensemble_goes_back_too_and_begins_a_new_average_there(awake, batch, mask):
    agent = awake(backtrack_frames=20, temporal_ensemble_coeff=0.01)
    there = play(agent, shown(batch, mask, FIRST), 7)
    turned = shown(batch, mask, OTHER)
    back = play(agent, turned, 7)
    torch.testing.assert_close(back[0], there[0].flip(0), rtol=0, atol=0)
    plan = agent.predict_action_chunk(turned)
    torch.testing.assert_close(play(agent, turned, 1)[0, 0], plan[0, 0], rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize(("steps", "goes_back"), [(7, True), (8, False)])
def test_after_a_longer_way_another_target_is_no_change_of_mind(awake, batch, mask, steps, goes_back):
    agent = awake(backtrack_frames=7, n_action_steps=1)
    there = play(agent, shown(batch, mask, FIRST), steps)
    turned = shown(batch, mask, OTHER)
    plan = agent.predict_action_chunk(turned)
    expected = there[0].flip(0)[0] if goes_back else plan[0, 0]
    torch.testing.assert_close(play(agent, turned, 1)[0, 0], expected, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize(("steps", "expected"), [(8, [6, 3, 0]), (7, [6, 3, 0]), (6, [3, 0])])
def test_a_fast_way_back_leaves_actions_out_but_never_the_first(awake, batch, mask, steps, expected):
    agent = awake(backtrack_frames=20, backtrack_stride=3, n_action_steps=4)
    there = play(agent, shown(batch, mask, FIRST), steps)
    turned = shown(batch, mask, OTHER)
    plan = agent.predict_action_chunk(turned)
    back = play(agent, turned, len(expected) + 1)
    torch.testing.assert_close(back[0, :-1], there[0, expected], rtol=0, atol=0)
    torch.testing.assert_close(back[0, -1], plan[0, 0], rtol=1e-5, atol=1e-5)


PLACES = st.lists(st.sampled_from([None, 0, 1, 2]), min_size=1, max_size=40)


@given(PLACES)
def test_the_way_back_ends_where_the_way_began_whatever_is_shown(places):
    """Each action is a step that the opposite one undoes, and a step is named by its number."""
    places = [place for place in places for _ in range(STILL_FRAMES + 2)]
    way_back, stack, was_leading = WayBack(100), [], False
    for number, place in enumerate(places):
        mask = torch.zeros(1, 1, 1, 3)
        if place is not None:
            mask[..., place] = 1.0
        has_arrived = bool(way_back.look(mask))
        is_leading = bool(way_back.is_leading)
        assert has_arrived is (was_leading and not is_leading)
        played = int(way_back.led(torch.tensor([[float(number)]])))
        if is_leading:
            assert played == stack.pop()
        else:
            assert played == number
            stack.append(number)
        was_leading = is_leading
