"""Speed of `mask_act` beside LeRobot's ACT: training samples per second, inference time per plan."""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import torch
from lerobot.configs import PreTrainedConfig
from lerobot.configs.types import FeatureType, PolicyFeature
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.policies.factory import get_policy_class
from torch import Tensor

from lerobot_excav.policies.mask_act.configuration_mask_act import TARGET_MASK_KEY, MaskACTConfig

STATE_SIZE, ACTION_SIZE = 8, 4  # the excavator's; both cost next to nothing


@dataclass(frozen=True, kw_only=True)
class PolicySpeed:
    """Measured speed of one policy.

    Attributes:
        name: "act", "mask_act paper" or "mask_act fast".
        parameter_count: Trainable parameters.
        training_samples_per_s: Samples through one full optimiser step per second: the median over the rounds.
        inference_ms: Median time of one plan for one environment [ms].
    """

    name: str
    parameter_count: int
    training_samples_per_s: float
    inference_ms: float


def measure_policies(
    *,
    batch_size: int = 32,
    rounds: int = 5,
    height: int = 96,
    width: int = 128,
    chunk_size: int = 100,
    threads: int = 2,
) -> list[PolicySpeed]:
    """Measure LeRobot's ACT and both presets of `mask_act` on random data with two cameras and a mask.

    The policies take turns, one step each per round, so that other work on the machine slows all of them alike.
    LeRobot's ACT reads the mask as a third camera, as it does when trained on the same dataset.

    Args:
        batch_size: Samples per optimiser step.
        rounds: Timed steps per policy, after one that is not timed.
        height: Rows of the pictures.
        width: Columns of the pictures.
        chunk_size: Actions per plan.
        threads: CPU threads that PyTorch may use; restored afterwards.

    Returns:
        One entry per policy: act, mask_act paper, mask_act fast.
    """
    configs = policy_configs(height=height, width=width, chunk_size=chunk_size)
    threads_before = torch.get_num_threads()
    torch.set_num_threads(threads)
    try:
        policies = {name: get_policy_class(config.type)(config) for name, config in configs.items()}
        batch = random_batch(next(iter(configs.values())), batch_size)
        steps = {name: training_step(policy, batch) for name, policy in policies.items()}
        training = take_turns(steps, rounds)
        plans = {name: planning(policy, random_batch(policy.config, 1)) for name, policy in policies.items()}
        inference = take_turns(plans, rounds)
    finally:
        torch.set_num_threads(threads_before)
    return [
        PolicySpeed(
            name=name,
            parameter_count=sum(p.numel() for p in policy.parameters() if p.requires_grad),
            training_samples_per_s=batch_size / statistics.median(training[name]),
            inference_ms=1e3 * statistics.median(inference[name]),
        )
        for name, policy in policies.items()
    ]


def policy_configs(*, height: int, width: int, chunk_size: int) -> dict[str, PreTrainedConfig]:
    """Return the settings of the policies to compare, by name.

    Args:
        height: Rows of the pictures.
        width: Columns of the pictures.
        chunk_size: Actions per plan.
    """
    image = PolicyFeature(type=FeatureType.VISUAL, shape=(3, height, width))
    cameras = ("observation.images.main", "observation.images.cab", TARGET_MASK_KEY)
    shared: dict[str, Any] = {
        "input_features": {
            **dict.fromkeys(cameras, image),
            "observation.state": PolicyFeature(type=FeatureType.STATE, shape=(STATE_SIZE,)),
        },
        "output_features": {"action": PolicyFeature(type=FeatureType.ACTION, shape=(ACTION_SIZE,))},
        "chunk_size": chunk_size,
        "n_action_steps": chunk_size,
        "device": "cpu",
        "pretrained_backbone_weights": None,
    }
    return {
        "act": ACTConfig(**shared),
        "mask_act paper": MaskACTConfig(preset="paper", **shared),
        "mask_act fast": MaskACTConfig(preset="fast", **shared),
    }


def random_batch(config: PreTrainedConfig, batch_size: int) -> dict[str, Tensor]:
    """Return random observations and actions of the shapes that a configuration names.

    Args:
        config: Settings with features.
        batch_size: Number of samples.
    """
    generator = torch.Generator().manual_seed(0)
    features = {**config.input_features, **config.output_features}
    batch = {key: torch.rand(batch_size, *ft.shape, generator=generator) for key, ft in features.items()}
    batch["action"] = torch.rand(batch_size, config.chunk_size, ACTION_SIZE, generator=generator)
    batch["action_is_pad"] = torch.zeros(batch_size, config.chunk_size, dtype=torch.bool)
    return batch


def training_step(policy: Any, batch: dict[str, Tensor]) -> Callable[[], None]:
    """Return the optimiser step that `lerobot-train` makes: loss, gradients, clipping, update.

    Args:
        policy: Policy with the optimizer preset of its configuration.
        batch: Samples of the step.
    """
    preset = policy.config.get_optimizer_preset()
    optimizer = preset.build(policy.get_optim_params())

    def step() -> None:
        policy.train()
        loss, _ = policy.forward(batch)
        loss.backward()
        torch.nn.utils.clip_grad_norm_(policy.parameters(), preset.grad_clip_norm)
        optimizer.step()
        optimizer.zero_grad()

    return step


def planning(policy: Any, batch: dict[str, Tensor]) -> Callable[[], None]:
    """Return the prediction of one chunk of actions.

    Args:
        policy: Policy to ask.
        batch: Observations.
    """
    observation = {key: value for key, value in batch.items() if key.startswith("observation.")}

    def plan() -> None:
        policy.predict_action_chunk(observation)

    return plan


def take_turns(tasks: dict[str, Callable[[], None]], rounds: int) -> dict[str, list[float]]:
    """Time tasks in turns.

    Args:
        tasks: What to time, by name; each is run once untimed first.
        rounds: Timed runs of each.

    Returns:
        Durations [s] of each task.
    """
    for task in tasks.values():
        task()
    durations: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(rounds):
        for name, task in tasks.items():
            start = time.perf_counter()
            task()
            durations[name].append(time.perf_counter() - start)
    return durations
