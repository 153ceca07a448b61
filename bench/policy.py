"""Speed of `mask_act` beside LeRobot's ACT: training samples per second, inference time per plan.

    python -m bench.policy            # five timed rounds
    python -m bench.policy --quick    # two

Every network reads the same random data: two cameras and a mask of 96 x 128, chunks of 100 actions, batches of 32, on
two threads. The networks take turns, so that other work on the machine slows all of them alike. LeRobot's ACT reads
the mask as a third camera, as it does when it is trained on the same dataset.
"""

import argparse
import statistics
import time
from collections.abc import Callable
from typing import Any

import torch
from lerobot.configs import PreTrainedConfig
from lerobot.configs.types import FeatureType, PolicyFeature
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.policies.factory import get_policy_class

from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig
from lerobot_excav.policies.mask_act.mask_input import TARGET_MASK_KEY

CAMERAS = ("observation.images.main", "observation.images.cab", TARGET_MASK_KEY)
STATE_SIZE, ACTION_SIZE = 8, 4  # the excavator's; both cost next to nothing

Task = Callable[[], Any]


def policy_configs(*, height: int, width: int, chunk_size: int) -> dict[str, PreTrainedConfig]:
    """Return the settings of the policies to compare, by name, for pictures of height x width pixels."""
    image = PolicyFeature(type=FeatureType.VISUAL, shape=(3, height, width))
    state = PolicyFeature(type=FeatureType.STATE, shape=(STATE_SIZE,))
    shared: dict[str, Any] = {
        "input_features": {**dict.fromkeys(CAMERAS, image), "observation.state": state},
        "output_features": {"action": PolicyFeature(type=FeatureType.ACTION, shape=(ACTION_SIZE,))},
        **{"chunk_size": chunk_size, "n_action_steps": chunk_size},
        **{"device": "cpu", "pretrained_backbone_weights": None},
    }
    return {
        "act": ACTConfig(**shared),
        "mask_act paper": MaskACTConfig(preset="paper", **shared),
        "mask_act fast": MaskACTConfig(preset="fast", **shared),
    }


def random_batch(config: PreTrainedConfig, batch_size: int) -> dict[str, torch.Tensor]:
    """Return random observations and actions of the shapes that a configuration names."""
    generator = torch.Generator().manual_seed(0)
    features = config.input_features.items()
    batch = {key: torch.rand(batch_size, *ft.shape, generator=generator) for key, ft in features}
    batch[TARGET_MASK_KEY] = batch[TARGET_MASK_KEY].round()
    batch["action"] = torch.rand(batch_size, config.chunk_size, ACTION_SIZE, generator=generator)
    batch["action_is_pad"] = torch.zeros(batch_size, config.chunk_size, dtype=torch.bool)
    return batch


def training_step(policy: Any, batch: dict[str, torch.Tensor]) -> Task:
    """Return the optimiser step that `lerobot-train` makes: loss, gradients, clipping, update."""
    preset = policy.config.get_optimizer_preset()
    optimizer = preset.build(policy.get_optim_params())

    def step() -> None:
        policy.train()
        policy.forward(batch)[0].backward()
        torch.nn.utils.clip_grad_norm_(policy.parameters(), preset.grad_clip_norm)
        optimizer.step()
        optimizer.zero_grad()

    return step


def planning(policy: Any) -> Task:
    """Return the prediction of one chunk of actions for one environment."""
    batch = random_batch(policy.config, 1)
    observation = {key: batch[key] for key in policy.config.input_features}
    return lambda: policy.predict_action_chunk(observation)


def take_turns(tasks: dict[str, Task], rounds: int) -> dict[str, float]:
    """Run tasks in turns, each once untimed and then `rounds` times; return the median time of each [s]."""
    for task in tasks.values():
        task()
    durations: dict[str, list[float]] = {name: [] for name in tasks}
    for _ in range(rounds):
        for name, task in tasks.items():
            start = time.perf_counter()
            task()
            durations[name].append(time.perf_counter() - start)
    return {name: statistics.median(times) for name, times in durations.items()}


def measure(*, rounds: int, batch_size: int = 32, height: int = 96, width: int = 128, chunk_size: int = 100) -> None:
    """Print the speeds of all policies, one number a line."""
    configs = policy_configs(height=height, width=width, chunk_size=chunk_size)
    policies = {name: get_policy_class(config.type)(config) for name, config in configs.items()}
    batch = random_batch(configs["act"], batch_size)
    training = take_turns({name: training_step(policy, batch) for name, policy in policies.items()}, rounds)
    plans = take_turns({name: planning(policy) for name, policy in policies.items()}, rounds)
    for name in policies:
        print(f"{'training ' + name:42} {batch_size / training[name]:10.2f} samples/s")
        print(f"{'planning ' + name:42} {1e3 * plans[name]:10.2f} ms per chunk")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        prog="python -m bench.policy", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="two rounds in place of five")
    torch.set_num_threads(2)
    measure(rounds=2 if parser.parse_args().quick else 5)
