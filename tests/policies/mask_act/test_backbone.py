import pytest
import torch
from torch import nn

from lerobot_excav.policies.mask_act.backbone import Backbone, coordinates

BACKBONES = ("resnet_small", "resnet18")


@pytest.fixture
def backbone(config):
    def build(name="resnet_small", **settings):
        torch.manual_seed(0)
        return Backbone(config(vision_backbone=name, **settings)).eval()

    return build


def stem(backbone):
    return next(m for m in backbone.modules() if isinstance(m, nn.Conv2d))


def test_coordinates_run_from_edge_to_edge():
    rows, columns = coordinates(torch.zeros(2, 4, 3, 5))[0]
    assert rows[:, 0].tolist() == [-1, 0, 1]
    assert columns[0].tolist() == [-1, -0.5, 0, 0.5, 1]
    assert torch.equal(rows, rows[:, :1].expand(3, 5))
    assert torch.equal(columns, columns[:1].expand(3, 5))


@pytest.mark.parametrize("name", BACKBONES)
def test_coordinates_start_as_heavy_as_colours_and_the_mask_stays_at_zero(backbone, name):
    plain, placed = backbone(name), backbone(name, coordinate_channels=True)
    assert (stem(plain).in_channels, stem(placed).in_channels) == (4, 6)
    colours, mask, places = stem(placed).weight.detach().split((3, 1, 2), dim=1)
    assert torch.equal(colours, stem(plain).weight[:, :3])
    assert not mask.any()
    assert 0.9 < places.std() / colours.std() < 1.1


@pytest.mark.parametrize("name", BACKBONES)
def test_training_changes_what_is_made_of_coordinates(backbone, name):
    placed = backbone(name, coordinate_channels=True).train()
    placed(torch.rand(2, 4, 64, 96)).square().mean().backward()
    assert stem(placed).weight.grad[:, 4:].abs().amax(dim=(0, 2, 3)).min() > 0


def test_with_coordinates_the_same_picture_differs_from_place_to_place(backbone):
    uniform = torch.full((1, 4, 160, 320), 0.5)  # wide: the middle cells see no border

    def spread(network):
        middle = network(uniform)[0, :, 5, 7:13]
        return (middle - middle[:, :1]).abs().max()

    with torch.no_grad():
        assert spread(backbone(coordinate_channels=True)) > 1e-3
        assert spread(backbone()) < 1e-6
