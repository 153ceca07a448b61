import shlex
import shutil
from pathlib import Path

import draccus
import numpy as np
import pytest
import torch
from lerobot.configs.default import DatasetConfig
from lerobot.datasets.aggregate import aggregate_datasets
from lerobot.datasets.lerobot_dataset import LeRobotDataset
from lerobot.policies.factory import make_policy
from lerobot.transforms import ImageTransforms, ImageTransformsConfig
from torch.utils.data import default_collate

from lerobot_excav.errors import ConfigurationError, DatasetError
from lerobot_excav.policies.mask_act.configuration_mask_act import MaskACTConfig
from lerobot_excav.policies.mask_act.training_masks import BATCHES_BETWEEN, SAFE_TRANSFORMS, stored_mask

from .conftest import CHUNK, HEIGHT, MAIN, MASK, STATE, TINY, WIDTH

GOAL = "observation.images.goal"
FRAMES = 6
FEATURES = {
    STATE: {"dtype": "float32", "shape": (2,), "names": ["a.pos", "b.pos"]},
    "action": {"dtype": "float32", "shape": (2,), "names": ["a.pos", "b.pos"]},
}


def square(top, left, size=6, on=255):
    mask = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    mask[top : top + size, left : left + size] = on
    return mask


def moving(episode, frame):
    return square(2 + 5 * episode, 4 + 5 * frame)


def write(root, mask_of=moving, *, key=MASK, dtype="image", episodes=2):
    """Write a dataset with LeRobot's own writer."""
    images = {
        k: {"dtype": dtype, "shape": (HEIGHT, WIDTH, 3), "names": ["height", "width", "channels"]} for k in (MAIN, key)
    }
    dataset = LeRobotDataset.create("tests/masks", 10, FEATURES | images, root, use_videos=dtype == "video")
    generator = np.random.default_rng(0)
    for episode in range(episodes):
        for frame in range(FRAMES):
            numbers = {name: generator.random(2, np.float32) for name in FEATURES}
            picture = generator.integers(0, 255, (HEIGHT, WIDTH, 3), np.uint8)
            dataset.add_frame({**numbers, MAIN: picture, key: mask_of(episode, frame), "task": "go"})
        dataset.save_episode(parallel_encoding=False)
    dataset.finalize()
    return root


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """The same masks as images, as videos, and of two datasets that LeRobot has put together."""
    base = tmp_path_factory.mktemp("masks")
    for dtype in ("image", "video"):
        write(base / dtype, dtype=dtype)
    parts = [write(base / f"part{n}", lambda episode, frame, n=n: moving(episode + n, frame)) for n in range(2)]
    aggregate_datasets(["tests/masks"] * 2, "tests/masks", roots=parts, aggr_root=base / "merged")
    return base


def opened(root, **kwargs):
    return LeRobotDataset(
        "tests/masks", root=root, delta_timestamps={"action": [n / 10 for n in range(CHUNK)]}, **kwargs
    )


def trained_on(dataset, **settings):
    config = MaskACTConfig(**{**TINY, **settings})
    return make_policy(config, ds_meta=dataset.meta).train()


def frames(dataset, numbers):
    return default_collate([dataset[n] for n in numbers])


def moved(batch, rows, *, by=2):
    """The same batch with the masks of some rows moved apart from their pictures."""
    mask = batch[MASK].clone()
    mask[rows] = mask[rows].roll(by, dims=-1)
    return {**batch, MASK: mask}


@pytest.mark.parametrize("kind", ["image", "video", "merged"])
@pytest.mark.parametrize("episodes", [None, [1]])
def test_the_stored_mask_is_what_the_dataset_gives(folders, kind, episodes):
    dataset = opened(folders / kind, episodes=episodes)
    for item in dataset:
        frame = {"index": int(item["index"]), "episode": int(item["episode_index"])}
        stored = stored_mask(dataset.meta, MASK, **frame)
        torch.testing.assert_close(stored, item[MASK][:1])
        assert stored.max() > 0.9


@pytest.mark.parametrize("kind", ["image", "video", "merged"])
def test_a_mask_that_has_left_its_place_is_refused_in_the_first_batch(folders, kind):
    dataset = opened(folders / kind, episodes=[1])
    batch = frames(dataset, range(4))
    trained_on(dataset).forward(batch)
    message = (
        r"frame 8 \(episode 1\) .*36 pixels around row 9\.5, column 16\.5, in training 36 pixels around row 9\.5, "
        r"column 18\.5.*image_transforms\.tfs=.*augment_shift_px.*compare_masks=false"
    )
    with pytest.raises(ConfigurationError, match=message):
        trained_on(dataset).forward(moved(batch, [2]))


def test_a_mask_that_leaves_its_place_later_is_refused_when_its_turn_comes(folders):
    dataset = opened(folders / "image")
    policy, batch = trained_on(dataset), frames(dataset, range(4))
    policy.forward(batch)
    bad = moved(batch, [0, 1, 2, 3])
    for _ in range(BATCHES_BETWEEN - 1):
        policy.forward(bad)
    with pytest.raises(ConfigurationError, match="is not the one"):
        policy.forward(bad)


@pytest.mark.parametrize(
    "change",
    [
        lambda mask: 0.45 * mask,  # a brightness that puts white below one half
        lambda mask: 1 - mask,
        lambda mask: mask.flip(-1),
        lambda mask: mask.roll(WIDTH // 2, dims=-1) * 0,
    ],
)
def test_a_mask_that_is_darkened_inverted_flipped_or_gone_is_refused(folders, change):
    dataset = opened(folders / "image")
    batch = frames(dataset, range(4))
    with pytest.raises(ConfigurationError, match="is not the one"):
        trained_on(dataset).forward({**batch, MASK: change(batch[MASK])})


@pytest.mark.parametrize("settings", [{"compare_masks": False}, {"withhold_mask": True}])
def test_masks_that_are_not_used_or_not_to_be_compared_pass(folders, settings):
    dataset = opened(folders / "image")
    trained_on(dataset, **settings).forward(moved(frames(dataset, range(4)), [2]))


def test_validation_compares_nothing_because_lerobot_does_not_transform_it(folders):
    dataset = opened(folders / "image")
    trained_on(dataset).eval().forward(moved(frames(dataset, range(4)), [2]))


def test_a_mask_renamed_on_the_way_is_compared_with_its_own_column(folders, tmp_path):
    first = trained_on(opened(folders / "image"))
    first.save_pretrained(tmp_path / "checkpoint")
    dataset = opened(write(tmp_path / "data", key=GOAL))

    def tuned():
        first.config.pretrained_path = tmp_path / "checkpoint"
        return make_policy(first.config, ds_meta=dataset.meta, rename_map={GOAL: MASK}).train()

    batch = frames(dataset, range(4))
    batch[MASK] = batch.pop(GOAL)
    tuned().forward(batch)
    with pytest.raises(ConfigurationError, match="is not the one"):
        tuned().forward(moved(batch, [2]))


def test_a_camera_renamed_on_the_way_has_no_statistics_and_is_refused(folders):
    dataset = opened(folders / "image")
    policy = trained_on(dataset)
    dataset.meta.stats["observation.images.cam"] = dataset.meta.stats.pop(MAIN)
    with pytest.raises(ConfigurationError, match=rf"no statistics for {MAIN} .*rename_map renames no statistics"):
        make_policy(policy.config, ds_meta=dataset.meta, rename_map={"observation.images.cam": MAIN})


def test_what_cannot_be_compared_is_said(folders, tmp_path, caplog):
    dataset = opened(shutil.copytree(folders / "image", tmp_path / "data"))
    batch = frames(dataset, range(4))
    trained_on(dataset).forward({key: value for key, value in batch.items() if key != "index"})
    assert "no index" in caplog.text
    caplog.clear()
    shutil.rmtree(tmp_path / "data" / "data")
    trained_on(dataset).forward(batch)
    assert "file-000.parquet is not on this machine" in caplog.text
    assert SAFE_TRANSFORMS in caplog.text


def test_a_frame_that_its_file_does_not_hold_is_an_error(folders):
    meta = opened(folders / "image").meta
    with pytest.raises(DatasetError, match=r"file-000\.parquet holds 0 frames whose index is 99"):
        stored_mask(meta, MASK, index=99, episode=0)


def test_the_transforms_named_as_safe_leave_every_mask_as_it_is():
    arguments = shlex.split(SAFE_TRANSFORMS.replace("--dataset.", "--"))
    assert SAFE_TRANSFORMS in (Path(__file__).parents[3] / "docs/reference/mask_act.md").read_text(encoding="utf-8")
    config = draccus.parse(DatasetConfig, args=["--repo_id=x", *arguments]).image_transforms
    torch.manual_seed(0)
    transform, pictures = ImageTransforms(config), 0
    for draw in range(300):
        mask = (torch.rand(3, 16, 24)[:1] < (0.02, 0.3, 0.98)[draw % 3]).expand(3, -1, -1)
        for stored in (mask.float(), mask.to(torch.uint8) * 255):
            half = 0.5 if stored.dtype == torch.float32 else 127.5
            assert torch.equal(transform(stored) > half, mask)
        picture = torch.rand(3, 16, 24)
        pictures += not torch.equal(transform(picture), picture)
    assert pictures == 300


@pytest.mark.parametrize("name", ["brightness", "contrast", "saturation", "hue", "sharpness"])
def test_of_lerobots_default_transforms_only_affine_is_refused(folders, name):
    both = {key: tf for key, tf in ImageTransformsConfig().tfs.items() if key in (name, "affine")}
    for tfs, is_fine in (({name: both[name]}, True), (both, False)):
        torch.manual_seed(0)
        transforms = ImageTransforms(ImageTransformsConfig(enable=True, tfs=tfs))
        dataset = opened(folders / "image", image_transforms=transforms)
        policy, batch = trained_on(dataset), frames(dataset, range(4))
        if is_fine:
            policy.forward(batch)
        else:
            with pytest.raises(ConfigurationError, match="is not the one"):
                policy.forward(batch)


@pytest.mark.parametrize(
    ("on", "off", "message"),
    [
        (0, 0, r"target_mask.*empty in every frame.*withhold_mask=true"),
        (1, 0, r"target_mask.*values up to 1 of 255.*Store 0 .* and 255.*withhold_mask=true"),
        (90, 0, r"values up to 90 of 255"),
        (255, 255, r"covers the whole picture in every frame"),
    ],
)
def test_masks_that_say_nothing_in_any_frame_are_refused_before_training(tmp_path, on, off, message):
    root = write(tmp_path / "data", lambda *_: np.maximum(square(4, 4, on=on), np.uint8(off)))
    dataset = opened(root)
    with pytest.raises(ConfigurationError, match=message):
        trained_on(dataset)
    trained_on(dataset, withhold_mask=True).forward(frames(dataset, range(4)))


def test_masks_of_0_and_1_in_a_part_of_the_dataset_are_refused(tmp_path):
    root = write(tmp_path / "data", lambda episode, frame: square(4, 4 + frame, on=1 if episode else 255))
    dataset = opened(root)
    policy = trained_on(dataset)
    policy.forward(frames(dataset, range(4)))
    with pytest.raises(ConfigurationError, match=r"frame 7 \(episode 1\) has values up to 1 of 255.*Store 0 .* 255"):
        trained_on(dataset).forward(frames(dataset, [0, 1, 7, 8]))


def test_masks_of_0_and_1_are_refused_without_statistics_too(policy, batch, caplog):
    agent, data = policy().train(), batch(actions=True)
    agent.forward({**data, MASK: torch.zeros_like(data[MASK])})
    assert "built without its dataset" in caplog.text
    with pytest.raises(ConfigurationError, match=r"target_mask holds 0 and 0\.00392.*255"):
        agent.forward({**data, MASK: data[MASK] / 255})
