import torch
from lerobot.optim import AdamWConfig, OptimizerConfig

from lerobot_excav.policies.mask_act.fused_adamw import FusedAdamWConfig


def test_fused_update_equals_lerobots_adamw():
    generator = torch.Generator().manual_seed(0)
    start = torch.randn(7, 5, generator=generator)
    results = []
    for kind in (AdamWConfig, FusedAdamWConfig):
        parameter = torch.nn.Parameter(start.clone())
        optimizer = kind(lr=1e-2, weight_decay=0.1).build([parameter])
        gradients = torch.Generator().manual_seed(1)
        for _ in range(5):
            parameter.grad = torch.randn(7, 5, generator=gradients)
            optimizer.step()
        results.append(parameter.detach())
    torch.testing.assert_close(*results, rtol=1e-5, atol=1e-6)


def test_fused_adamw_is_registered():
    assert OptimizerConfig.get_choice_class("excav_fused_adamw") is FusedAdamWConfig
