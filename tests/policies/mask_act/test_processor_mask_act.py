import torch
from lerobot.policies.factory import make_pre_post_processors
from lerobot.processor import NormalizerProcessorStep

MAIN, MASK = "observation.images.main", "observation.images.target_mask"


def statistics(config):
    """Statistics as `--dataset.use_imagenet_stats` leaves them: those of photographs, for the mask too."""
    stats = {
        key: {"mean": torch.full((3, 1, 1), 0.45), "std": torch.full((3, 1, 1), 0.22)}
        for key in config.image_features
    }
    stats["observation.state"] = {"mean": torch.full((8,), 2.0), "std": torch.full((8,), 4.0)}
    stats["action"] = {"mean": torch.full((4,), 1.0), "std": torch.full((4,), 0.5)}
    return stats


def observation(batch):
    return {key: value[0] for key, value in batch(1).items()}


def check(preprocess, batch):
    raw = observation(batch)
    out = preprocess(dict(raw))
    assert torch.equal(out[MASK][0], raw[MASK])
    torch.testing.assert_close(out[MAIN][0], (raw[MAIN] - 0.45) / 0.22)
    torch.testing.assert_close(out["observation.state"][0], (raw["observation.state"] - 2.0) / 4.0)


def test_everything_but_the_mask_is_normalised(config, batch):
    settings = config()
    preprocess, _ = make_pre_post_processors(settings, dataset_stats=statistics(settings))
    check(preprocess, batch)


def test_actions_are_restored(config):
    settings = config()
    _, postprocess = make_pre_post_processors(settings, dataset_stats=statistics(settings))
    torch.testing.assert_close(postprocess(torch.ones(2, 4)), torch.full((2, 4), 1.5))


def test_the_mask_stays_out_of_normalisation_through_fine_tuning(tmp_path, config, batch):
    settings = config()
    for processor in make_pre_post_processors(settings, dataset_stats=statistics(settings)):
        processor.save_pretrained(tmp_path)
    features = {**settings.input_features, **settings.output_features}
    # The overrides of lerobot-train --policy.path.
    preprocess, _ = make_pre_post_processors(
        settings,
        pretrained_path=str(tmp_path),
        preprocessor_overrides={
            "device_processor": {"device": "cpu"},
            "normalizer_processor": {
                "features": features,
                "norm_map": settings.normalization_mapping,
                "stats": statistics(settings),
            },
            "rename_observations_processor": {"rename_map": {}},
        },
    )
    check(preprocess, batch)
    step = next(step for step in preprocess.steps if isinstance(step, NormalizerProcessorStep))
    assert MASK not in step.normalize_observation_keys


def test_mask_key_decides_what_is_left_out(config, batch):
    settings = config(mask_key=MAIN, main_camera=MASK)
    preprocess, _ = make_pre_post_processors(settings, dataset_stats=statistics(settings))
    raw = observation(batch)
    assert torch.equal(preprocess(dict(raw))[MAIN][0], raw[MAIN])
