import pytest
import torch
from lerobot.policies.factory import make_pre_post_processors
from lerobot.processor import NormalizerProcessorStep

from .conftest import MAIN, MASK, STATE


@pytest.fixture
def statistics(config):
    """Statistics as `--dataset.use_imagenet_stats` leaves them: those of photographs, for the mask too."""
    photographs = {"mean": torch.full((3, 1, 1), 0.45), "std": torch.full((3, 1, 1), 0.22)}
    return {
        **dict.fromkeys(config().image_features, photographs),
        STATE: {"mean": torch.full((8,), 2.0), "std": torch.full((8,), 4.0)},
        "action": {"mean": torch.full((4,), 1.0), "std": torch.full((4,), 0.5)},
    }


def check(preprocess, batch):
    """Raise unless everything but the mask is normalised."""
    raw = {key: value[0] for key, value in batch(1).items()}
    out = preprocess(dict(raw))
    assert torch.equal(out[MASK][0], raw[MASK])
    torch.testing.assert_close(out[MAIN][0], (raw[MAIN] - 0.45) / 0.22)
    torch.testing.assert_close(out[STATE][0], (raw[STATE] - 2.0) / 4.0)


def test_everything_but_the_mask_is_normalised_and_actions_are_restored(config, batch, statistics):
    preprocess, postprocess = make_pre_post_processors(config(), dataset_stats=statistics)
    check(preprocess, batch)
    torch.testing.assert_close(postprocess(torch.ones(2, 4)), torch.full((2, 4), 1.5))


def test_the_mask_stays_out_of_normalisation_through_fine_tuning(tmp_path, config, batch, statistics):
    settings = config()
    for processor in make_pre_post_processors(settings, dataset_stats=statistics):
        processor.save_pretrained(tmp_path)
    features = {**settings.input_features, **settings.output_features}
    norm = {"features": features, "norm_map": settings.normalization_mapping, "stats": statistics}
    # The overrides of lerobot-train --policy.path.
    overrides = {
        "device_processor": {"device": "cpu"},
        "normalizer_processor": norm,
        "rename_observations_processor": {"rename_map": {}},
    }
    preprocess, _ = make_pre_post_processors(settings, pretrained_path=str(tmp_path), preprocessor_overrides=overrides)
    check(preprocess, batch)
    step = next(step for step in preprocess.steps if isinstance(step, NormalizerProcessorStep))
    assert MASK not in step.normalize_observation_keys


def test_mask_key_decides_what_is_left_out(config, batch, statistics):
    settings = config(mask_key=MAIN, main_camera=MASK)
    preprocess, _ = make_pre_post_processors(settings, dataset_stats=statistics)
    raw = batch(1)
    assert torch.equal(preprocess(dict(raw))[MAIN], raw[MAIN])
