"""When a mask shows another target than the one that the plan was made for."""

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.policies.mask_act.target_watch import TargetWatch

from .conftest import MASK, square_mask


def remembered(watch, mask):
    """Ask, and plan where it was asked for."""
    changed = watch.changed(mask)
    watch.planned(changed, mask)
    return changed.tolist()


def test_by_default_first_masks_and_masks_with_one_other_pixel_are_changes(config):
    watch, masks = TargetWatch(config().replan_iou), torch.zeros(2, 1, 4, 6)
    assert remembered(watch, masks) == [True, True]
    assert remembered(watch, masks.clone()) == [False, False]
    moved = masks.clone()
    moved[1, 0, 3, 5] = 1
    assert remembered(watch, moved) == [False, True]
    watch.clear()
    assert remembered(watch, moved) == [True, True]


# A square of 12 x 12 pixels, moved by 4: 96 of 192 pixels are shared, IoU 0.5; moved by 12 none.
@pytest.mark.parametrize(("iou", "left", "is_new"), [(0.4, 20, False), (0.6, 20, True), (0.01, 28, True)])
def test_a_plan_is_kept_while_masks_overlap_enough(iou, left, is_new):
    watch = TargetWatch(iou)
    remembered(watch, square_mask(1, top=8, left=16)[:, :1])
    assert remembered(watch, square_mask(1, top=8, left=left)[:, :1]) == [is_new]


def test_a_mask_that_wanders_off_in_small_steps_is_compared_with_the_plans_and_not_with_the_last():
    watch = TargetWatch(0.4)
    masks = [square_mask(1, top=8, left=16 + step)[:, :1] for step in range(9)]
    changes = [remembered(watch, mask)[0] for mask in masks]
    # IoU with the plan's is (12 - n) / (12 + n) after n steps: 0.41 after 5, 0.33 after 6.
    assert changes == [True, False, False, False, False, False, True, False, False]


@settings(max_examples=50, deadline=None)
@given(
    st.lists(st.lists(st.integers(0, 63), min_size=2, max_size=2), min_size=1, max_size=8),
    st.sampled_from([0.1, 0.5, 0.9, 1.0]),
)
def test_changes_equal_those_of_sets_of_pixels(words, iou):
    """Masks of 6 pixels, each a number of 6 bits, in two environments."""
    watch, plans = TargetWatch(iou), [None, None]
    for word in words:
        pixels = [{bit for bit in range(6) if number >> bit & 1} for number in word]
        mask = torch.tensor([[float(bit in chosen) for bit in range(6)] for chosen in pixels]).reshape(2, 1, 2, 3)
        expected = []
        for number, chosen in enumerate(pixels):
            plan = plans[number]
            is_new = plan is None or (bool(plan | chosen) and len(plan & chosen) / len(plan | chosen) < iou)
            expected.append(is_new)
            plans[number] = chosen if is_new else plan
        assert remembered(watch, mask) == expected


@pytest.mark.parametrize(("iou", "plans"), [(1.0, 6), (0.4, 2)])
def test_a_policy_keeps_its_plan_while_its_mask_jitters(awake, batch, iou, plans, monkeypatch):
    agent, made = awake(replan_iou=iou, n_action_steps=4), []
    planned = agent.predict_action_chunk
    monkeypatch.setattr(agent, "predict_action_chunk", lambda seen: made.append(seen) or planned(seen))
    for step in range(6):
        observation = batch(batch_size=1)
        observation[MASK] = square_mask(1, top=8 + step % 2, left=16)
        agent.select_action(observation)
    assert len(made) == plans
