"""Pictures come back from either storage, and everything that reads them reads both."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from lerobot.datasets import LeRobotDataset, delete_episodes, merge_datasets, split_dataset

from lerobot_excav.datasets.check.quality_check import check_dataset
from lerobot_excav.datasets.format.episode_table import iterate_episodes, read_info
from lerobot_excav.datasets.format.pair import Pair
from lerobot_excav.datasets.format.storage import STORAGES
from lerobot_excav.datasets.pairs.paired_index import build_index, write_index
from lerobot_excav.datasets.record.simulation import play_demonstration
from lerobot_excav.errors import DatasetError

MASK, MAIN = "observation.images.target_mask", "observation.images.main"
COLOUR_TOLERANCE = 2
"""Grey levels by which a video's conversion of colours may be off."""


def load(root):
    return LeRobotDataset(f"local/{root.name}", root=root, video_backend="pyav")


def played(toy_rig, toy_settings, uid, **changes):
    return play_demonstration(toy_rig(), toy_settings(**changes), Pair.parse(uid))


@pytest.fixture(scope="module", params=["excavator", "fr5_grasp"])
def env(request):
    return request.param


@pytest.fixture(scope="module", params=STORAGES)
def storage(request):
    return request.param


@pytest.fixture(scope="module")
def dataset(env, storage, record_toy, tmp_path_factory):
    """Two scenes of an environment in a storage. Not to be changed by tests."""
    out = tmp_path_factory.mktemp("stored") / "dataset"
    record_toy(out, env=env, scenes=2, storage=storage)
    return out


def test_lerobot_reads_the_pictures_that_were_played(dataset, env, storage, toy_rig, toy_settings):
    episode = played(toy_rig, toy_settings, f"{env}/train/1/2", env=env)
    frames = load(dataset)
    for frame in range(episode.length):
        item = frames[6 * 6 + frame]
        assert item["excav.pair_uid"] == episode.pair.uid
        for camera, pictures in episode.images.items():
            image = (item[f"observation.images.{camera}"].numpy() * 255).round().transpose(1, 2, 0)
            is_exact = storage == "image" or camera == "target_mask"
            tolerance = 0 if is_exact else COLOUR_TOLERANCE
            np.testing.assert_allclose(image, pictures[frame], atol=tolerance)


def test_episode_tables_read_what_lerobot_reads(dataset):
    frames = load(dataset)
    for episode in iterate_episodes(dataset, (MAIN, MASK), episodes=[0, 5]):
        assert episode.distinct_images(MASK) == 1
        for key in (MAIN, MASK):
            image = (frames[6 * episode.index + 4][key].numpy() * 255).round().transpose(1, 2, 0)
            np.testing.assert_array_equal(episode.image(key, 4), image)
            np.testing.assert_array_equal(episode.first_frame().image(key, 0), episode.image(key, 0))


def test_a_sound_dataset_passes_the_check_with_replays(dataset, toy_rig, tmp_path):
    shutil.copytree(dataset, tmp_path / "d")
    rows = check_dataset(tmp_path / "d", replays=8, rig=toy_rig())
    assert rows["qc_problem"].tolist() == [""] * 8
    assert rows["replayed"].all()


def test_the_index_sees_the_mask(dataset):
    row = build_index(dataset).iloc[6]
    centroid = (row["mask_centroid_row_px"], row["mask_centroid_column_px"])
    assert (row["mask_area_px"], *centroid) == (32, 13.5, 11.5)


def test_a_grey_mask_is_found(env, storage, record_toy, toy_rig, tmp_path, monkeypatch):
    see = toy_rig().environment.__globals__["ToyEnv"]._observe

    def grey(self):
        observation = see(self)
        observation["pixels"]["target_mask"] //= 2
        return observation

    monkeypatch.setattr(toy_rig().environment.__globals__["ToyEnv"], "_observe", grey)
    record_toy(tmp_path / "d", env=env, scenes=1, targets=1, storage=storage)
    (problem,) = check_dataset(tmp_path / "d", replays=0)["qc_problem"]
    assert problem == "the target mask is not binary: it holds [0, 127]; allowed are 0 and 255"


def test_a_mask_that_changes_is_found(storage, record_toy, toy_rig, tmp_path, monkeypatch):
    see = toy_rig().environment.__globals__["ToyEnv"]._observe

    def changing(self):
        observation = see(self)
        observation["pixels"]["target_mask"][0, 0] = 255 if self.frame == 5 else 0
        return observation

    monkeypatch.setattr(toy_rig().environment.__globals__["ToyEnv"], "_observe", changing)
    record_toy(tmp_path / "d", scenes=1, targets=1, storage=storage)
    (problem,) = check_dataset(tmp_path / "d", replays=0)["qc_problem"]
    assert problem == "the target mask changes within the episode"


def test_every_episode_has_video_files_of_its_own(arm_dataset):
    assert len(list(arm_dataset.glob(f"videos/{MAIN}/*/*.mp4"))) == 8


def test_videos_stay_lossless_and_readable_through_lerobots_tools(arm_dataset, toy_rig, tmp_path):
    delete_episodes(load(arm_dataset), [0], output_dir=tmp_path / "d", repo_id="local/d")
    parts = split_dataset(load(arm_dataset), {"a": [0, 5], "b": [1, 7]}, output_dir=tmp_path)
    # Merging puts the episodes of a camera into one file.
    merged = merge_datasets([parts["b"], parts["a"]], "local/m", output_dir=tmp_path / "m").root
    original = {
        episode.pair: episode
        for episode in iterate_episodes(
            arm_dataset, (MAIN, "excav.pair_uid", "excav.scene_id", "excav.target_id")
        )
    }
    for root, count in ((tmp_path / "d", 7), (tmp_path / "a", 2), (merged, 4)):
        rows = check_dataset(root, replays=1, rig=toy_rig())
        assert rows["qc"].tolist() == ["passed"] * count
        assert read_info(root).environment.name == "fr5_grasp"
        for row in rows.itertuples():
            (episode,) = iterate_episodes(root, (MAIN,), episodes=[row.episode_index])
            np.testing.assert_array_equal(
                episode.image(MAIN, 3), original[Pair.parse(row.pair_uid)].image(MAIN, 3)
            )


def test_a_video_that_lacks_a_picture_is_named(arm_dataset):
    (episode, *_) = iterate_episodes(arm_dataset, (MAIN,))
    longer = replace(episode.pictures[MAIN], length=episode.length + 1)
    with pytest.raises(DatasetError, match=r"\.mp4 lacks the picture at 0\.120 s"):
        longer.frame(episode.length)


def test_videos_have_the_same_bytes_every_time(tmp_path, record_toy):
    for name in ("one", "other"):
        record_toy(tmp_path / name, env="fr5_grasp", scenes=1, targets=2)
    files = sorted(path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*.mp4"))
    assert len(files) == 6
    for file in files:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "other" / file).read_bytes()


def test_the_index_of_the_arm_has_its_outcome_and_no_soil(arm_dataset, tmp_path):
    shutil.copytree(arm_dataset, tmp_path / "d")
    index = write_index(tmp_path / "d")
    assert {"first_grasped_block", "target_in_tray", "blocks_in_tray"} <= set(index.columns)
    assert not {"soil", "fidelity", "retained_mass_kg"} & set(index.columns)
    assert index["pair_uid"].tolist()[:2] == ["fr5_grasp/train/0/0", "fr5_grasp/train/0/1"]
