"""Pre- and post-processing of `mask_act`: LeRobot's own steps, with the mask kept out of normalisation."""

from typing import Any

import torch
from lerobot.processor import NormalizerProcessorStep, PolicyAction, PolicyProcessorPipeline
from lerobot.processor.factory import make_default_policy_processor_steps, make_policy_processor_pipelines

from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig

Pipelines = tuple[
    PolicyProcessorPipeline[dict[str, Any], dict[str, Any]], PolicyProcessorPipeline[PolicyAction, PolicyAction]
]


def make_mask_act_pre_post_processors(
    config: MaskACTConfig, dataset_stats: dict[str, dict[str, torch.Tensor]] | None = None
) -> Pipelines:
    """Build the pipelines rename, batch, device, normalise and unnormalise, CPU.

    The mask is excluded by the list of keys to normalise, not by its features or its statistics: fine-tuning
    (`lerobot-train --policy.path`) replaces features and statistics, and `--dataset.use_imagenet_stats` gives every
    image feature statistics of photographs. The list is saved with the step and survives both.
    """
    steps = make_default_policy_processor_steps(config, dataset_stats, normalizer_device=config.device)
    normalize = NormalizerProcessorStep(
        features=steps.normalize.features,
        norm_map=config.normalization_mapping,
        stats=dataset_stats,
        device=config.device,
        normalize_observation_keys=set(config.input_features) - {config.mask_key},
    )
    pipelines: Pipelines = make_policy_processor_pipelines(
        input_steps=[steps.rename_observations, steps.add_batch_dim, steps.to_device, normalize],
        output_steps=[steps.unnormalize, steps.to_cpu],
    )
    return pipelines
