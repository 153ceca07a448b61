import pytest
import torch

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.picture_shift import shift_together

from .conftest import CAB, HEIGHT, MAIN, MASK, WIDTH


def test_picture_and_mask_move_together_and_the_border_is_edge_and_no_target():
    picture = torch.rand(200, 3, 12, 16)
    mask = (torch.rand(200, 1, 12, 16) < 0.5).float()
    moved_picture, moved_mask = shift_together(picture, mask, 2)
    padded = torch.nn.functional.pad(picture, (2, 2, 2, 2), mode="replicate")
    padded_mask = torch.nn.functional.pad(mask, (2, 2, 2, 2))
    seen = set()
    for i in range(200):
        fits = [
            (down, right)
            for down in range(-2, 3)
            for right in range(-2, 3)
            if torch.equal(moved_picture[i], padded[i, :, 2 - down : 14 - down, 2 - right : 18 - right])
        ]
        assert len(fits) == 1
        down, right = fits[0]
        assert torch.equal(moved_mask[i], padded_mask[i, :, 2 - down : 14 - down, 2 - right : 18 - right])
        seen.add((down, right))
    assert len(seen) == 25  # every shift is drawn


def test_the_seed_decides_and_other_views_stay(policy, batch, monkeypatch):
    agent, data = policy(augment_shift_px=4).train(), batch(actions=True)
    shown = []
    run = agent.model.forward
    monkeypatch.setattr(
        agent.model, "forward", lambda views, *args, **kw: (shown.append(views), run(views, *args, **kw))[1]
    )
    for seed in (0, 0, 1):
        torch.manual_seed(seed)
        agent.forward(data)
    first, again, other = shown
    assert torch.equal(first[0], again[0])
    assert not torch.equal(first[0], other[0])
    assert not torch.equal(first[0][:, :3], data[MAIN])
    assert not torch.equal(first[0][:, 3:], data[MASK][:, :1])
    assert torch.equal(first[1][:, :3], data[CAB])


def test_it_is_off_by_default_in_validation_and_when_acting(policy, batch):
    agent, still = policy(augment_shift_px=4), policy()
    data = batch(actions=True)
    assert torch.equal(agent.forward(data)[0], still.forward(data)[0])  # validation
    assert torch.equal(agent.predict_action_chunk(data), still.predict_action_chunk(data))
    state = torch.get_rng_state()
    loss = still.train().forward(data)[0]
    assert torch.equal(state, torch.get_rng_state())  # nothing is drawn
    assert not torch.equal(agent.train().forward(data)[0], loss)


@pytest.mark.parametrize("value", [-1, 1.5, True, float("nan"), float("inf"), None, "2"])
def test_a_shift_is_a_whole_number_of_pixels(config, value):
    with pytest.raises(ConfigurationError, match="augment_shift_px"):
        config(augment_shift_px=value)


def test_a_shift_that_leaves_nothing_in_view_is_refused(policy):
    policy(augment_shift_px=HEIGHT - 1)
    with pytest.raises(ConfigurationError, match=rf"augment_shift_px={HEIGHT}.*\(3, {HEIGHT}, {WIDTH}\).*0 to 31"):
        policy(augment_shift_px=HEIGHT)
