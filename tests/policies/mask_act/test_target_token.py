import pytest
import torch

from lerobot_excav.policies.mask_act.target_token import TargetToken


@pytest.fixture
def token():
    torch.manual_seed(0)
    return TargetToken(8)


def maps(seed=0):
    generator = torch.Generator().manual_seed(seed)
    return torch.randn(1, 8, 2, 3, generator=generator), torch.randn(1, 8, 2, 3, generator=generator)


def test_a_mask_over_one_cell_takes_that_cell_alone(token):
    features, grid = maps()
    mask = torch.zeros(1, 1, 32, 48)
    mask[..., 16:32, 0:16] = 1
    content, position = token(features, grid, mask)
    expected = features[0, :, 1, 0] + token.position_proj(grid[0, :, 1, 0]) + token.kind_embed
    torch.testing.assert_close(content[0], expected)
    torch.testing.assert_close(position[0], grid[0, :, 1, 0])


def test_cells_weigh_as_much_as_the_mask_covers_them(token):
    features, grid = maps()
    mask = torch.zeros(1, 1, 32, 48)
    mask[..., 0:16, 12:32] = 1  # a quarter of cell 0, all of cell 1
    _, position = token(features, grid, mask)
    torch.testing.assert_close(position[0], (grid[0, :, 0, 0] + 4 * grid[0, :, 0, 1]) / 5)


def test_an_empty_mask_gives_the_learned_token_whatever_the_picture(token):
    empty = torch.zeros(1, 1, 32, 48)
    for seed in range(3):
        content, position = token(*maps(seed), empty)
        assert torch.equal(content[0], token.no_target_embed)
        assert not position.any()


def test_an_empty_mask_beside_a_full_one_leaves_finite_gradients(token):
    features, grid = maps()
    features = features.repeat(2, 1, 1, 1).requires_grad_()
    mask = torch.zeros(2, 1, 32, 48)
    mask[1] = 1
    content, _ = token(features, grid, mask)
    content.square().sum().backward()
    assert torch.isfinite(features.grad).all()
    assert not features.grad[0].any()
    assert features.grad[1].any()


def test_a_single_pixel_is_a_target(token):
    mask = torch.zeros(1, 1, 32, 48)
    mask[..., 31, 47] = 1
    features, grid = maps()
    _, position = token(features, grid, mask)
    torch.testing.assert_close(position[0], grid[0, :, 1, 2])
