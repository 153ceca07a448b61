import pytest
import torch
from torch import nn

from lerobot_excav.policies.mask_act.backbone import Backbone, coordinates

from .conftest import BACKBONES, stem


@pytest.fixture
def backbone(config):
    def build(name="resnet_small", **settings):
        torch.manual_seed(0)
        return Backbone(config(vision_backbone=name, **settings)).eval()

    return build


def test_coordinates_run_from_edge_to_edge():
    rows, columns = coordinates(torch.zeros(2, 4, 3, 5))[0]
    assert torch.equal(rows, torch.tensor([-1.0, 0.0, 1.0])[:, None].expand(3, 5))
    assert torch.equal(columns, torch.tensor([-1.0, -0.5, 0.0, 0.5, 1.0]).expand(3, 5))


@pytest.mark.parametrize("name", BACKBONES)
def test_coordinates_start_as_heavy_as_colours_the_mask_at_zero_and_training_moves_both(backbone, name):
    plain, placed = backbone(name), backbone(name, coordinate_channels=True)
    assert (stem(plain).in_channels, stem(placed).in_channels) == (4, 6)
    colours, mask, places = stem(placed).weight.detach().split((3, 1, 2), dim=1)
    assert torch.equal(colours, stem(plain).weight[:, :3])
    assert not mask.any()
    assert 0.9 < places.std() / colours.std() < 1.1
    placed.train()(torch.rand(2, 4, 64, 96)).square().mean().backward()
    assert stem(placed).weight.grad[:, 3:].abs().amax(dim=(0, 2, 3)).min() > 0


def test_with_coordinates_the_same_picture_differs_from_place_to_place(backbone):
    uniform = torch.full((1, 4, 160, 320), 0.5)  # wide: the middle cells see no border

    def spread(network):
        middle = network(uniform)[0, :, 5, 7:13]
        return (middle - middle[:, :1]).abs().max()

    with torch.no_grad():
        assert spread(backbone(coordinate_channels=True)) > 1e-3
        assert spread(backbone()) < 1e-6


@pytest.mark.parametrize("name", BACKBONES)
@pytest.mark.parametrize(("norm", "learns"), [("batch", True), ("frozen", False)])
def test_the_norm_learns_and_averages_statistics_or_never_changes(backbone, name, norm, learns):
    network = backbone(name, backbone_norm=norm).train()
    assert any(isinstance(m, nn.BatchNorm2d) for m in network.modules()) == learns
    before = {key: value.clone() for key, value in network.named_buffers() if "running" in key}
    network(torch.rand(2, 4, 64, 96))
    after = dict(network.named_buffers())
    assert {not torch.equal(value, after[key]) for key, value in before.items()} == {learns}
