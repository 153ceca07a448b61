"""Convolutional backbones that read red, green, blue, target mask and, if asked, the place of each pixel."""

from collections import OrderedDict

import torch
import torchvision
from torch import Tensor, nn
from torchvision.models.resnet import BasicBlock
from torchvision.ops.misc import FrozenBatchNorm2d

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig, resolved

SMALL_STEM_WIDTH = 32
SMALL_STAGES = ((32, 1), (64, 2), (128, 2))  # width, stride of each residual block


class Backbone(nn.Module):
    """Map views to feature maps of `feature_count` channels, by a convolutional network without its classifier."""

    def __init__(self, config: MaskACTConfig) -> None:
        super().__init__()
        norm = nn.BatchNorm2d if config.backbone_norm == "batch" else FrozenBatchNorm2d
        if config.vision_backbone == "resnet_small":
            self.stages: nn.Module = small_resnet(norm)
            self.feature_count = SMALL_STAGES[-1][0]
        else:
            self.stages, self.feature_count = torchvision_resnet(config, norm)
        self.coordinate_channels = config.coordinate_channels
        if config.coordinate_channels:
            with_coordinate_channels(next(m for m in self.stages.modules() if isinstance(m, nn.Conv2d)))

    def forward(self, views: Tensor) -> Tensor:
        """Return the feature map, shape (N, feature_count, h, w), of views (N, 4, H, W)."""
        if self.coordinate_channels:
            views = torch.cat([views, coordinates(views).expand(views.shape[0], -1, -1, -1)], dim=1)
        # Channels last is the layout that convolutions on a CPU compute in: twice as fast in the first layer.
        features: Tensor = self.stages(views.contiguous(memory_format=torch.channels_last))
        return features


def small_resnet(norm: type[nn.Module]) -> nn.Sequential:
    """Build a narrow residual network from (N, 4, H, W) to (N, 128, H / 16, W / 16), to be trained from scratch.

    It is meant for pictures of about 100 pixels. Its first convolution has stride 4: at stride 2 that layer and its
    normalisation cost as much as all the rest.
    """
    stem = nn.Conv2d(3, SMALL_STEM_WIDTH, kernel_size=7, stride=4, padding=3, bias=False)
    nn.init.kaiming_normal_(stem.weight, mode="fan_out", nonlinearity="relu")
    layers: list[nn.Module] = [with_mask_channel(stem), norm(SMALL_STEM_WIDTH), nn.ReLU(inplace=True)]
    width_in = SMALL_STEM_WIDTH
    for width, stride in SMALL_STAGES:
        same = width == width_in and stride == 1
        shortcut = None if same else nn.Sequential(nn.Conv2d(width_in, width, 1, stride, bias=False), norm(width))
        layers.append(BasicBlock(width_in, width, stride=stride, downsample=shortcut, norm_layer=norm))
        width_in = width
    return nn.Sequential(*layers)


def torchvision_resnet(config: MaskACTConfig, norm: type[nn.Module]) -> tuple[nn.Module, int]:
    """Build a ResNet of torchvision up to its last stage, as ACT does, with a fourth input channel; count its features.

    Weights are not fetched for a policy that comes from a checkpoint, which brings its own.

    Raises:
        ConfigurationError: torchvision has no such network.
    """
    name = resolved(config.vision_backbone)
    build = getattr(torchvision.models, name, None)
    if build is None:
        raise ConfigurationError(f"vision_backbone={name!r} is not in torchvision.models; try resnet18.")
    resnet = build(
        replace_stride_with_dilation=[False, False, config.replace_final_stride_with_dilation],
        weights=config.pretrained_backbone_weights if config.pretrained_path is None else None,
        norm_layer=norm,
    )
    feature_count = resnet.fc.in_features
    resnet.conv1 = with_mask_channel(resnet.conv1)
    # A ResNet's children run in their order of definition; the last two, pooling and classifier, are left out.
    return nn.Sequential(OrderedDict(list(resnet.named_children())[:-2])), feature_count


def with_mask_channel(stem: nn.Conv2d) -> nn.Conv2d:
    """Widen a first convolution, in place, by one input channel that starts at zero weight.

    A fresh network is therefore blind to the mask, and equals its twin without one, until training finds a use for
    it. Copying the mean of the RGB filters instead would start from a response to the mask as if it were brightness.
    """
    return widened(stem, torch.zeros_like(stem.weight[:, :1]))


def with_coordinate_channels(stem: nn.Conv2d) -> nn.Conv2d:
    """Widen a first convolution, in place, by two input channels with random weights as large as its RGB filters'.

    From zero weights the network found the coordinates too late to profit in a short training.
    """
    return widened(stem, torch.randn_like(stem.weight[:, :2]) * stem.weight[:, :3].std().detach())


def widened(stem: nn.Conv2d, weight: Tensor) -> nn.Conv2d:
    """Append input channels with weights, (out, new, k, k), to a convolution without bias, in place; return it."""
    stem.weight = nn.Parameter(torch.cat([stem.weight.detach(), weight], dim=1))
    stem.in_channels = stem.weight.shape[1]
    return stem


def coordinates(views: Tensor) -> Tensor:
    """Return row and column of every pixel of views, each from -1 to 1, (1, 2, H, W) (CoordConv, arXiv:1807.03247).

    A convolution alone answers alike wherever a pattern lies, and attention adds positions to queries and keys only.
    With these two channels the network can say where it sees the mask.
    """
    height, width = views.shape[-2:]
    rows = torch.linspace(-1, 1, height, device=views.device, dtype=views.dtype)
    columns = torch.linspace(-1, 1, width, device=views.device, dtype=views.dtype)
    return torch.stack(torch.meshgrid(rows, columns, indexing="ij")).unsqueeze(0)
