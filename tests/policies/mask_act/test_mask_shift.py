import pytest
import torch

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.mask_shift import shift_alone

from .conftest import HEIGHT, MAIN, MASK, WIDTH


def test_every_shift_is_drawn_and_what_comes_in_is_no_target():
    mask = (torch.rand(300, 1, 12, 16) < 0.5).float()
    moved = shift_alone(mask, 2)
    padded = torch.nn.functional.pad(mask, (2, 2, 2, 2))
    seen = set()
    for i in range(300):
        fits = [
            (down, right)
            for down in range(-2, 3)
            for right in range(-2, 3)
            if torch.equal(moved[i], padded[i, :, 2 - down : 14 - down, 2 - right : 18 - right])
        ]
        assert len(fits) == 1
        seen.add(fits[0])
    assert len(seen) == 25


def test_a_mask_that_would_leave_the_picture_stays():
    mask = torch.zeros(400, 1, 12, 16)
    mask[:, :, 0, 0] = 1.0
    moved = shift_alone(mask, 3)
    assert torch.equal(moved.flatten(1).sum(dim=1), torch.ones(400))
    assert (moved[:, 0, 0, 0] == 1).float().mean() > 0.5  # most shifts would lose it
    assert (moved[:, 0, 0, 0] == 0).any()


def test_a_mask_that_would_leave_the_crop_stays():
    mask = torch.zeros(400, 1, 12, 16)
    mask[:, :, 4, 4] = 1.0
    moved = shift_alone(mask, 3, [4, 4, 6, 6])
    assert (moved[:, :, 4:10, 4:10].flatten(1).sum(dim=1) == 1.0).all()
    assert (shift_alone(mask, 3)[:, :, 4:10, 4:10].flatten(1).sum(dim=1) == 0.0).any()


def test_it_has_no_effect_without_a_mask_and_says_so(policy):
    with pytest.raises(ConfigurationError, match=r"augment_mask_px=2 has no effect with policy\.withhold_mask=true"):
        policy(augment_mask_px=2, withhold_mask=True)


def test_only_the_mask_moves_in_training_only_and_the_seed_decides(policy, batch, monkeypatch):
    agent, still, data = policy(augment_mask_px=4), policy(), batch(actions=True)
    assert torch.equal(agent.forward(data)[0], still.forward(data)[0])  # validation
    assert torch.equal(agent.predict_action_chunk(data), still.predict_action_chunk(data))
    shown = []
    run = agent.train().model.forward
    monkeypatch.setattr(
        agent.model, "forward", lambda views, *args, **kw: (shown.append(views[0]), run(views, *args, **kw))[1]
    )
    for seed in (0, 0, 1):
        torch.manual_seed(seed)
        agent.forward(data)
    first, again, other = shown
    assert torch.equal(first, again)
    assert not torch.equal(first[:, 3:], other[:, 3:])
    assert torch.equal(first[:, :3], data[MAIN])
    assert not torch.equal(first[:, 3:], data[MASK][:, :1])


@pytest.mark.parametrize("value", [-1, 1.5, True, float("nan"), None, "2"])
def test_a_shift_is_a_whole_number_of_pixels(config, value):
    with pytest.raises(ConfigurationError, match="augment_mask_px"):
        config(augment_mask_px=value)


def test_a_shift_that_leaves_nothing_in_view_is_refused(policy):
    policy(augment_mask_px=HEIGHT - 1)
    with pytest.raises(ConfigurationError, match=rf"augment_mask_px={HEIGHT}.*\(3, {HEIGHT}, {WIDTH}\).*0 to 31"):
        policy(augment_mask_px=HEIGHT)
