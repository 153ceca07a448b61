"""Training the click segmenter: minutes on two cores."""

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn.functional import binary_cross_entropy_with_logits
from tqdm import tqdm

from lerobot_excav.datasets.clicks.clicked_scenes import ClickedScene, click_on
from lerobot_excav.envs.masks.click.network import ClickNetwork
from lerobot_excav.envs.masks.click.window import cut_out, window

LEARNING_RATE = 2e-3
"""Greatest rate of AdamW, reached after a tenth of the steps (kind: guess)."""

LIGHT = 0.25
"""By how much each colour and the brightness are drawn brighter or darker (kind: guess)."""


def train(
    scenes: Sequence[ClickedScene], *, steps: int, batch_size: int, seed: int, show_progress: bool = False
) -> ClickNetwork:
    """Train a network on scenes; the same arguments give the same network on one machine.

    The loss is the sum of cross-entropy and 1 minus the soft Dice coefficient (Milletari et al. 2016, eq. 3), which
    counts a small mask as much as a large one.
    """
    rng = np.random.default_rng(seed)
    torch.manual_seed(seed)
    network = ClickNetwork().train()
    optimizer = torch.optim.AdamW(network.parameters(), lr=LEARNING_RATE)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimizer, LEARNING_RATE, total_steps=steps, pct_start=max(0.1, 2 / steps)
    )
    with tqdm(total=steps, disable=not show_progress, desc="training", unit="step") as bar:
        for _ in range(steps):
            windows, masks = batch(scenes, batch_size, rng)
            optimizer.zero_grad()
            loss = _loss(network(windows), masks)
            loss.backward()  # type: ignore[no-untyped-call]  # of torch
            optimizer.step()
            schedule.step()
            bar.set_postfix_str(f"loss {loss.item():.3f}", refresh=False)
            bar.update()
    return network


def batch(scenes: Sequence[ClickedScene], size: int, rng: np.random.Generator) -> tuple[Tensor, Tensor]:
    """Draw clicks: windows (B, 5, S, S), and what was meant in them, (B, 1, S, S) float32."""
    drawn = [_sample(scenes[int(rng.integers(len(scenes)))], rng) for _ in range(size)]
    windows, masks = (torch.from_numpy(np.stack(parts)) for parts in zip(*drawn, strict=True))
    return windows, masks[:, None].float()


def _sample(scene: ClickedScene, rng: np.random.Generator) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    target = scene.targets[int(rng.integers(len(scene.targets)))]
    at = click_on(target, rng)
    seen = window(scene.picture, *at)
    gain = 1.0 + LIGHT * rng.uniform(-1.0, 1.0) * np.ones(3) + LIGHT * rng.uniform(-1.0, 1.0, 3)
    seen[:3] = np.clip((seen[:3] + 1.0) * gain[:, None, None].astype(np.float32) - 1.0, -1.0, 1.0)
    return seen, cut_out(target.mask, *at)


def _loss(logits: Tensor, masks: Tensor) -> Tensor:
    share = torch.sigmoid(logits)
    both, sizes = (share * masks).sum(dim=(1, 2, 3)), (share + masks).sum(dim=(1, 2, 3))
    dice = (2.0 * both + 1.0) / (sizes + 1.0)
    return binary_cross_entropy_with_logits(logits, masks) + (1.0 - dice).mean()
