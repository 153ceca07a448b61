import math
from fractions import Fraction

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.mask_shape import MASK_SHAPES, shaped

from .conftest import CAB, HEIGHT, MAIN, MASK, WIDTH, make_batch, stem

masks = hnp.arrays(
    np.float32,
    st.tuples(st.just(2), st.just(1), st.integers(3, 9), st.integers(3, 11)),
    elements=st.sampled_from([0.0, 1.0]),
)


def slow_box(mask):
    new = np.zeros_like(mask)
    for row in range(mask.shape[0]):
        for col in range(mask.shape[1]):
            is_between_rows = mask[: row + 1].any() and mask[row:].any()
            is_between_cols = mask[:, : col + 1].any() and mask[:, col:].any()
            new[row, col] = is_between_rows and is_between_cols
    return new


def slow_point(mask):
    new = np.zeros_like(mask)
    if mask.any():
        rows, cols = np.nonzero(mask)
        middle_row, middle_col = (
            math.floor(Fraction(sum(each.tolist()), len(each)) + Fraction(1, 2)) for each in (rows, cols)
        )
        for row in range(middle_row - 1, middle_row + 2):
            for col in range(middle_col - 1, middle_col + 2):
                if 0 <= row < mask.shape[0] and 0 <= col < mask.shape[1]:
                    new[row, col] = 1.0
    return new


@given(masks)
@pytest.mark.parametrize(("shape", "slow"), [("box", slow_box), ("point", slow_point), ("region", lambda mask: mask)])
def test_a_shape_is_what_a_slow_search_finds(shape, slow, mask):
    new = shaped(torch.from_numpy(mask), shape)
    assert new.dtype == torch.float32
    for given_mask, new_mask in zip(mask[:, 0], new[:, 0].numpy(), strict=True):
        np.testing.assert_array_equal(new_mask, slow(given_mask))


@given(masks)
@pytest.mark.parametrize("shape", ["region", "box"])
def test_a_mask_that_has_its_shape_already_stays(shape, mask):
    once = shaped(torch.from_numpy(mask), shape)
    assert torch.equal(shaped(once, shape), once)


@pytest.mark.parametrize("middle", [(1, 1), (5, 9), (HEIGHT - 2, WIDTH - 2)])
def test_a_point_inside_the_picture_stays(middle):
    row, col = middle
    mask = torch.zeros(1, 1, HEIGHT, WIDTH)
    mask[..., row - 1 : row + 2, col - 1 : col + 2] = 1.0
    assert torch.equal(shaped(mask, "point"), mask)


@given(st.integers(0, 20), st.integers(1, 9))
def test_a_mask_that_moves_by_a_pixel_moves_its_point_by_a_pixel(left, width):
    mask = torch.zeros(1, 1, 12, 40)
    mask[..., 4:7, 3 + left : 3 + left + width] = 1.0
    assert torch.equal(shaped(mask.roll(1, dims=3), "point"), shaped(mask, "point").roll(1, dims=3))


def ring(batch_size=3):
    """A square mask with a hole: region, box and point of it differ."""
    batch = make_batch(batch_size)
    batch[MASK][..., 11:17, 19:25] = 0.0
    return batch


def seen(agent, batch):
    """What the first convolution is given."""
    views = []
    stem(agent).register_forward_pre_hook(lambda _, inputs: views.append(inputs[0]))
    agent.predict_action_chunk(batch)
    return views[0]


@pytest.mark.parametrize(("shape", "pixels"), [("region", 12 * 12 - 6 * 6), ("box", 12 * 12), ("point", 9)])
def test_the_network_sees_the_shape_that_was_chosen(awake, shape, pixels):
    views = seen(awake(mask_shape=shape), ring())
    assert views[:, 3].sum(dim=(1, 2)).sort().values.tolist() == [0.0] * 3 + [float(pixels)] * 3


@pytest.mark.parametrize("token", [True, False])
def test_a_policy_of_boxes_or_points_acts_the_same_under_any_mask_with_that_box_or_middle(awake, token):
    holed, full = ring(), make_batch(3)
    for shape in MASK_SHAPES:
        agent = awake(mask_shape=shape, target_token=token)
        one, other = (agent.predict_action_chunk(batch) for batch in (holed, full))
        assert torch.equal(one, other) == (shape != "region")


def test_a_shape_is_made_of_the_mask_at_the_size_that_the_network_sees(awake):
    agent = awake(mask_shape="point", resize_to=[16, 24])
    views = seen(agent, ring())
    assert views.shape[2:] == (16, 24)
    assert views[:, 3].sum().item() == 3 * 9


@pytest.mark.parametrize("settings", [{"mask_shape": "box"}, {"mask_shape": "point"}, {"withhold_pictures": True}])
def test_a_training_step_sees_what_acting_sees(policy, settings):
    agent, batch = policy(target_token=True, **settings), make_batch(actions=True)
    loss, _ = agent.train().forward(batch)
    loss.backward()
    assert torch.isfinite(loss)
    colours = stem(agent).weight.grad[:, :3]
    assert bool(colours.any()) == ("withhold_pictures" not in settings)


def test_a_shape_of_a_withheld_mask_is_refused(policy):
    with pytest.raises(
        ConfigurationError, match=r"mask_shape=box has no effect with policy\.withhold_mask=true; give region"
    ):
        policy(mask_shape="box", withhold_mask=True)


def test_pictures_that_are_withheld_cannot_be_moved(policy):
    with pytest.raises(
        ConfigurationError, match=r"augment_shift_px=4 has no effect with policy\.withhold_pictures=true"
    ):
        policy(augment_shift_px=4, withhold_pictures=True)


def test_a_policy_without_pictures_sees_no_colour_of_any_camera_and_the_whole_mask(awake):
    batch = ring()
    views = seen(awake(withhold_pictures=True), batch)
    assert not views[:, :3].any()
    assert math.isclose(views[:, 3].sum().item(), batch[MASK][:, 0].sum().item())


@pytest.mark.parametrize("camera", [MAIN, CAB])
def test_pictures_change_nothing_for_a_policy_without_them_and_something_for_another(awake, camera):
    batch = make_batch()
    other = {**batch, camera: 1.0 - batch[camera]}
    for is_withheld in (True, False):
        agent = awake(withhold_pictures=is_withheld, target_token=True)
        with torch.no_grad():
            agent.model.target_token.feature_gain.fill_(1.0)
        plans = [agent.predict_action_chunk(given_batch) for given_batch in (batch, other)]
        assert torch.equal(*plans) == is_withheld


def test_a_policy_without_pictures_still_obeys_its_mask(awake, mask):
    agent, batch = awake(withhold_pictures=True), make_batch()
    other = {**batch, MASK: mask(3, top=2, left=2)}
    assert not torch.equal(agent.predict_action_chunk(batch), agent.predict_action_chunk(other))
