import pytest
import torch
from lerobot.policies.act.modeling_act import ACTSinusoidalPositionEmbedding2d

from lerobot_excav.policies.mask_act.target_token import TargetToken, axis_encodings

DIM, CELLS, STRIDE = 16, (3, 4), 16
SIZE = (CELLS[0] * STRIDE, CELLS[1] * STRIDE)


@pytest.fixture
def fresh():
    torch.manual_seed(0)
    return TargetToken(DIM)


@pytest.fixture
def token(fresh):
    """A token that has learned to use the features."""
    with torch.no_grad():
        fresh.feature_gain.fill_(0.7)
    return fresh


def features(seed=0, batch_size=1):
    return torch.randn(batch_size, DIM, *CELLS, generator=torch.Generator().manual_seed(seed))


def blob(top, left, height=6, width=6):
    mask = torch.zeros(1, 1, *SIZE)
    mask[..., top : top + height, left : left + width] = 1
    return mask


def pixel_by_pixel(mask):
    """The mean of LeRobot's formula over the pixels of a mask, one pixel at a time."""
    frequency = 10000 ** (-2 * (torch.arange(DIM // 2) // 2) / (DIM // 2))
    encodings = []
    for row, column in mask[0, 0].nonzero().tolist():
        halves = []
        for pixel, cells, pixels in ((row, CELLS[0], SIZE[0]), (column, CELLS[1], SIZE[1])):
            cell = (pixel + 0.5) * cells / pixels + 0.5  # the first cell's centre is 1
            angle = 2 * torch.pi * cell / cells * frequency
            halves.append(torch.where(torch.arange(DIM // 2) % 2 == 0, angle.sin(), angle.cos()))
        encodings.append(torch.cat(halves))
    return torch.stack(encodings).mean(dim=0)


def test_the_encoding_of_a_cell_centre_is_the_encoding_that_lerobot_gives_the_cell():
    grid = ACTSinusoidalPositionEmbedding2d(DIM // 2)(features())[0]  # (D, h, w)
    rows, columns = axis_encodings(CELLS[0], CELLS[0], DIM // 2), axis_encodings(CELLS[1], CELLS[1], DIM // 2)
    torch.testing.assert_close(rows, grid[: DIM // 2, :, 0].T, atol=1e-5, rtol=0)
    torch.testing.assert_close(columns, grid[DIM // 2 :, 0, :].T, atol=1e-5, rtol=0)


MASKS = {
    "corner": blob(0, 0),
    "wide": blob(7, 9, 3, 20),
    "whole picture": blob(0, 0, 48, 64),
    "one pixel": blob(47, 63, 1, 1),
    "two blobs": blob(2, 3, 4, 4) + blob(30, 50, 4, 8),
    "stray pixel": blob(20, 20) + blob(40, 60, 1, 1),
}


@pytest.mark.parametrize("mask", MASKS.values(), ids=MASKS)
def test_the_position_is_the_mean_over_the_masks_pixels(token, mask):
    content, position = token(features(), mask)
    torch.testing.assert_close(position[0], pixel_by_pixel(mask), atol=1e-5, rtol=0)
    assert not torch.equal(content[0], token.no_target_embed)


def test_pictures_that_the_cells_do_not_tile_are_encoded_from_edge_to_edge(token):
    mask = torch.ones(1, 1, 41, 57)
    _, position = token(features(), mask)
    _, tiled = token(features(), torch.ones(1, 1, *SIZE))
    torch.testing.assert_close(position, tiled, atol=1e-3, rtol=0)


@pytest.mark.parametrize(
    ("box", "shares"), [((16, 0, 16, 16), {(1, 0): 1.0}), ((0, 12, 16, 20), {(0, 0): 0.2, (0, 1): 0.8})]
)
def test_the_features_of_cells_weigh_as_much_as_the_mask_covers_them(token, box, shares):
    maps = features()
    content, position = token(maps, blob(*box))
    pooled = sum(share * maps[0, :, row, column] for (row, column), share in shares.items())
    torch.testing.assert_close(content[0], 0.7 * pooled + token.position_proj(position[0]) + token.kind_embed)


def test_an_empty_mask_gives_the_learned_token_whatever_the_picture(token):
    empty = torch.zeros(1, 1, *SIZE)
    for seed in range(3):
        content, position = token(features(seed), empty)
        assert torch.equal(content[0], token.no_target_embed)
        assert not position.any()


def test_an_empty_mask_beside_a_full_one_leaves_finite_gradients(token):
    maps = features(batch_size=2).requires_grad_()
    mask = torch.zeros(2, 1, *SIZE)
    mask[1] = 1
    content, _ = token(maps, mask)
    content.square().sum().backward()
    assert torch.isfinite(maps.grad).all()
    assert not maps.grad[0].any()
    assert maps.grad[1].any()


def test_a_fresh_token_reads_the_place_alone_and_training_finds_the_features(fresh):
    token, _ = fresh(features(0), blob(3, 5))
    assert torch.equal(token, fresh(features(1), blob(3, 5))[0])
    assert not torch.equal(token, fresh(features(0), blob(3, 6))[0])
    token.square().sum().backward()
    assert fresh.feature_gain.grad != 0
