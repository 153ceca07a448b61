"""Pictures come back from either storage, and everything that reads them reads both."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
import toy_reach.env
from lerobot.datasets import delete_episodes, merge_datasets, split_dataset

from lerobot_excav.datasets.check.quality_check import check_dataset
from lerobot_excav.datasets.format.dataset_info import read_info
from lerobot_excav.datasets.format.episode_table import iterate_episodes
from lerobot_excav.datasets.format.schema import COMMAND_KEY, PAIR_KEY, SCENE_KEY, STAGE_KEY, TARGET_KEY
from lerobot_excav.datasets.format.storage import STORAGES
from lerobot_excav.datasets.pairs.paired_index import build_index
from lerobot_excav.datasets.record.simulation import play_demonstration
from lerobot_excav.errors import DatasetError

from ..toy import CHANGE_FRAME, MAIN, MASK, load, record_toy, toy_settings

COLOUR_TOLERANCE = 2
"""Grey levels by which a video's conversion of colours may be off."""


@pytest.fixture(params=STORAGES)
def storage(request):
    return request.param


@pytest.fixture
def dataset(storage, changing_datasets):
    return changing_datasets[storage]


@pytest.fixture
def played(command_changes):
    """Episode 6 of the dataset as it was played."""
    settings = toy_settings(scenes=2)
    return play_demonstration(settings, settings.pairs()[6])


def image(item, key):
    return (item[key].numpy() * 255).round().transpose(1, 2, 0)


def test_lerobot_reads_the_pictures_that_were_played(dataset, storage, played):
    frames = load(dataset, [6])
    assert len(frames) == played.length > CHANGE_FRAME
    for frame, item in enumerate(frames):
        assert int(item["excav.target_id"]) == (2 if frame < CHANGE_FRAME else 3)
        for camera, pictures in played.images.items():
            is_exact = storage == "image" or camera == "target_mask"
            tolerance = 0 if is_exact else COLOUR_TOLERANCE
            np.testing.assert_allclose(image(item, f"observation.images.{camera}"), pictures[frame], atol=tolerance)


def test_episode_tables_read_what_lerobot_reads(dataset):
    for episode in iterate_episodes(dataset, (MAIN, MASK, TARGET_KEY), episodes=[0, 5]):
        items = load(dataset, [episode.index])
        assert len(set(episode.image_digests(MASK))) == 2
        for key in (MAIN, MASK):
            np.testing.assert_array_equal(episode.image(key, 5), image(items[5], key))
            np.testing.assert_array_equal(episode.first_frame().image(key, 0), episode.image(key, 0))


def test_a_command_that_names_a_target_of_the_same_number_again_is_seen(tmp_path, monkeypatch):
    monkeypatch.setattr(
        toy_reach.env.ReachEnv, "_next_target", lambda env: env.target_id if env._frame == CHANGE_FRAME else None
    )
    record_toy(tmp_path / "d", scenes=1, targets=1)
    (episode,) = iterate_episodes(tmp_path / "d", (TARGET_KEY, COMMAND_KEY))
    assert episode.schedule == ((CHANGE_FRAME, 0),)
    report = check_dataset(tmp_path / "d", replays=1)
    assert (report.problems, report.episodes["qc_problem"].tolist()) == ([], [""])


def test_a_dataset_with_changed_commands_passes_the_check_with_replays(dataset, tmp_path):
    shutil.copytree(dataset, tmp_path / "d")
    report = check_dataset(tmp_path / "d", replays=8)
    assert report.problems == []
    rows = report.episodes
    assert rows["qc_problem"].tolist() == [""] * 8
    assert rows["replayed"].all()


def test_the_index_sees_the_commands_and_the_first_mask(dataset, played):
    row = build_index(dataset).iloc[6]
    assert (row["target_id"], row["final_target_id"], row["commands"]) == (2, 3, 2)
    places = np.argwhere(played.images["target_mask"][0][..., 0])
    assert row["mask_area_px"] == len(places) > 5
    centroid = (row["mask_centroid_row_px"], row["mask_centroid_column_px"])
    assert centroid == tuple(places.mean(axis=0))


@pytest.mark.parametrize(
    ("spoil", "problem"),
    [
        (
            lambda mask, frame: mask // 2,
            "the target mask is not binary at frame 0: it holds [0, 127]; allowed are 0 and 255",
        ),
        (
            lambda mask, frame: np.roll(mask, int(frame == 5), axis=0),
            "the target mask changes between frames 0 and 7, though the command does not",
        ),
        (lambda mask, frame: mask * 0, "the target mask is empty from frame 0 on"),
    ],
    ids=["grey", "changing", "empty"],
)
def test_a_mask_that_is_wrong_is_found(storage, tmp_path, monkeypatch, spoil, problem):
    draw = toy_reach.env.ReachEnv._draw

    def spoiled(env, camera):
        picture = draw(env, camera)
        return spoil(picture, env._frame) if camera == "target_mask" else picture

    monkeypatch.setattr(toy_reach.env.ReachEnv, "_draw", spoiled)
    record_toy(tmp_path / "d", first_scene=1, scenes=1, targets=1, storage=storage)
    assert check_dataset(tmp_path / "d", replays=0).episodes["qc_problem"].tolist() == [problem]


@pytest.mark.slow
def test_videos_and_commands_survive_lerobots_tools(changing_datasets, tmp_path):
    original = changing_datasets["video"]
    assert len(list(original.glob(f"videos/{MAIN}/*/*.mp4"))) == 8  # each episode has its own
    delete_episodes(load(original), [0], output_dir=tmp_path / "d", repo_id="local/d")
    parts = split_dataset(load(original), {"a": [0, 5], "b": [1, 7]}, output_dir=tmp_path)
    # Merging puts the episodes of a camera into one file.
    merged = merge_datasets([parts["b"], parts["a"]], "local/m", output_dir=tmp_path / "m").root
    keys = (MAIN, PAIR_KEY, SCENE_KEY, STAGE_KEY, TARGET_KEY)
    pictures = {episode.pair.uid: episode.image(MAIN, 5) for episode in iterate_episodes(original, keys)}
    for root, count in ((tmp_path / "d", 7), (tmp_path / "a", 2), (merged, 4)):
        report = check_dataset(root, replays=1)
        assert report.problems == []
        assert report.episodes["qc"].tolist() == ["passed"] * count
        assert build_index(root)["commands"].tolist() == [2] * count
        assert read_info(root).spec.id == "Reach-v0"
        for episode in iterate_episodes(root, keys):
            np.testing.assert_array_equal(episode.image(MAIN, 5), pictures[episode.pair.uid])


def test_a_video_that_lacks_a_picture_is_named(changing_datasets):
    (episode, *_) = iterate_episodes(changing_datasets["video"], (MAIN,))
    longer = replace(episode.pictures[MAIN], length=episode.length + 1)
    with pytest.raises(DatasetError, match=r"\.mp4 lacks the picture at \d\.\d00 s"):
        longer.frame(episode.length)


def test_videos_have_the_same_bytes_every_time(tmp_path):
    for name in ("one", "other"):
        record_toy(tmp_path / name, scenes=1, targets=2, storage="video")
    files = sorted(path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*.mp4"))
    assert len(files) == 6
    for file in files:
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "other" / file).read_bytes()
