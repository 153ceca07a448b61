"""Masks of another source for a whole dataset: of this package, and of anybody else."""

import importlib.util
import json

import numpy as np
import pyarrow.parquet as pq
import pytest
from lerobot.datasets import LeRobotDataset

from lerobot_excav.datasets.check.quality_check import check_dataset
from lerobot_excav.datasets.format.schema import MASK_KEY, MASK_SOURCE_KEY
from lerobot_excav.datasets.masks import make_masks as make_masks_module
from lerobot_excav.datasets.masks import simulated_starts
from lerobot_excav.datasets.masks.make_masks import make_masks
from lerobot_excav.datasets.masks.mask_column import PROVENANCE_PATH
from lerobot_excav.envs.masks.click.segmenter import ClickSegmenter
from lerobot_excav.errors import ConfigurationError, DatasetError
from lerobot_excav.scripts.main import main

from ...envs.masks import tiny_models
from ..toy import load

STORAGES = ("image", "video")
POLYGON = "polygon = [[0.25, 0.25], [0.75, 0.25], [0.75, 0.75], [0.25, 0.75]]"


def masks_of(root):
    dataset = load(root)
    return np.stack([dataset[i][MASK_KEY].numpy()[0] > 0.5 for i in range(len(dataset))])


def columns_of(root):
    table = pq.read_table(sorted(root.glob("data/*/*.parquet"))[0])
    return {name: table[name].to_pylist() for name in table.column_names if name not in (MASK_KEY, MASK_SOURCE_KEY)}


def drawn(tmp_path, *keys):
    path = tmp_path / "drawn.toml"
    path.write_text("".join(f'[[mask]]\nkey = "{key}"\n{POLYGON}\n' for key in keys))
    return str(path)


@pytest.mark.slow
@pytest.mark.parametrize("storage", STORAGES)
def test_the_source_of_the_recording_makes_its_masks_again_where_commands_change_too(
    changing_datasets, tmp_path, storage
):
    root, out = changing_datasets[storage], tmp_path / "again"
    assert make_masks(root, out, source="oracle") == 8
    assert np.array_equal(masks_of(out), masks_of(root))
    assert columns_of(out) == columns_of(root)
    assert check_dataset(out, replays=2).has_passed
    assert not (out / "videos" / MASK_KEY).exists()


@pytest.mark.parametrize("storage", STORAGES)
def test_statistics_are_those_that_lerobot_would_have_written(changing_datasets, tmp_path, storage):
    make_masks(changing_datasets["image"], tmp_path / "again", source="oracle")
    ours, theirs = (load(root).meta.stats[MASK_KEY] for root in (tmp_path / "again", changing_datasets[storage]))
    assert set(ours) == set(theirs)
    for name in ("min", "max"):
        np.testing.assert_array_equal(ours[name], theirs[name])
    np.testing.assert_allclose(ours["mean"], theirs["mean"], atol=0.02)  # LeRobot weighs by frames, which it samples
    assert ours["mean"].shape == (3, 1, 1)


def test_masks_of_another_source_say_so(small_datasets, tmp_path):
    out = tmp_path / "drawn"
    make_masks(small_datasets["video"], out, source="manual", options=drawn(tmp_path, "*"))
    masks = masks_of(out)
    expected = np.zeros_like(masks[0])
    expected[8:24, 12:36] = True
    assert (masks == expected).all()
    (path,) = out.glob("data/*/*.parquet")
    assert set(pq.read_table(path)[MASK_SOURCE_KEY].to_pylist()) == {"manual"}
    noted = json.loads((out / PROVENANCE_PATH).read_text())
    assert (noted["source"], noted["options"], len(noted["episodes"])) == ("manual", "drawn.toml", 4)
    assert noted["episodes"][0]["masks"] == [{"frame": 0, "key": "*"}]


def test_an_interrupted_run_goes_on_and_one_of_other_options_is_kept_apart(small_datasets, tmp_path, monkeypatch):
    root, out, asked = small_datasets["image"], tmp_path / "out", []
    find = simulated_starts.find_masks

    def once_broken(recorded, *given, **options):
        asked.append(recorded.index)
        if len(asked) == 3:
            raise KeyboardInterrupt
        return find(recorded, *given, **options)

    monkeypatch.setattr(simulated_starts, "find_masks", once_broken)
    with pytest.raises(KeyboardInterrupt):
        make_masks(root, out, source="oracle")
    assert not out.exists()
    with pytest.raises(DatasetError, match=r"out\.masks\.jsonl was not begun by this command"):
        make_masks(root, out, source="manual", options=drawn(tmp_path, "*"))
    with (tmp_path / "out.masks.jsonl").open("a") as file:
        file.write('{"episode_index": 2, "ma')  # cut short
    make_masks(root, out, source="oracle")
    assert asked == [0, 1, 2, 2, 3]
    assert np.array_equal(masks_of(out), masks_of(root))
    assert {path.name for path in tmp_path.glob("out*")} <= {"out", "out.masks.lock"}


def test_a_file_of_somebody_else_in_the_way_is_kept(small_datasets, tmp_path):
    (tmp_path / "out.masks.jsonl").write_text("years of work")
    with pytest.raises(DatasetError, match="was not begun by this command"):
        make_masks(small_datasets["image"], tmp_path / "out", source="oracle")
    assert (tmp_path / "out.masks.jsonl").read_text() == "years of work"


def test_an_episode_in_which_nothing_is_found_is_named_and_nothing_is_written(small_datasets, tmp_path):
    text = '[[mask]]\nkey = "*"\npolygon = [[0.1, 0.1], [0.1001, 0.1], [0.1, 0.1001]]'
    (tmp_path / "thin.toml").write_text(text)
    with pytest.raises(DatasetError, match="episode 0: the source finds nothing for the command of frame 0"):
        make_masks(small_datasets["image"], tmp_path / "out", source="manual", options=str(tmp_path / "thin.toml"))
    assert not (tmp_path / "out").exists()


@pytest.fixture(scope="module")
def foreign(tmp_path_factory):
    """Two episodes of somebody else's arm: 6 axes, cameras top and wrist, 30 pictures a second, LeRobot's videos."""
    root = tmp_path_factory.mktemp("foreign") / "so101"
    joints = [f"joint_{i}.pos" for i in range(6)]
    vector = {"dtype": "float32", "shape": (6,), "names": joints}
    picture = {"dtype": "video", "shape": (48, 64, 3), "names": ["height", "width", "channels"]}
    cameras = {f"observation.images.{name}": picture for name in ("top", "wrist")}
    features = {"observation.state": vector, "action": vector, **cameras}
    dataset = LeRobotDataset.create("someone/so101", 30, features=features, root=root, robot_type="so101_follower")
    rng = np.random.default_rng(0)
    for _ in range(2):
        for frame in range(12):
            picture = rng.integers(0, 255, (48, 64, 3), dtype=np.uint8)
            dataset.add_frame(
                {"observation.state": np.full(6, frame, np.float32), "action": np.full(6, frame, np.float32)}
                | dict.fromkeys(cameras, picture)
                | {"task": "Take the red block."}
            )
        dataset.save_episode(parallel_encoding=False)
    dataset.finalize()
    return root


def test_somebody_elses_dataset_gets_masks_and_keeps_its_videos(foreign, tmp_path):
    out, options = tmp_path / "with_masks", drawn(tmp_path, "episode/0", "episode/1")
    flags = ["--source=manual", f"--mask.options={options}", "--main_camera=observation.images.top", f"--out={out}"]
    assert main(["masks", str(foreign), *flags]) == 0
    dataset = LeRobotDataset("someone/so101", root=out, video_backend="pyav")
    assert dataset[5][MASK_KEY].shape == (3, 48, 64)
    assert float(dataset[5][MASK_KEY].mean()) == pytest.approx(0.25)
    for path in foreign.rglob("*.mp4"):
        assert (out / path.relative_to(foreign)).read_bytes() == path.read_bytes()
    assert dataset.meta.stats[MASK_KEY]["mean"].ravel() == pytest.approx([0.25] * 3)


TOP = "--main_camera=observation.images.top"


def test_a_click_in_somebody_elses_picture_becomes_a_mask(foreign, tmp_path, monkeypatch):
    """The network would mark nothing in noise, so a planted one marks what is left above the click."""
    places = []

    def above(self, picture, row, column):
        places.append((picture.shape, row, column))
        rows, columns = np.indices(picture.shape[:2])
        return (rows < row * picture.shape[0]) & (columns < column * picture.shape[1])

    monkeypatch.setattr(ClickSegmenter, "pixels", above)
    (tmp_path / "clicks.toml").write_text('[[click]]\nkey = "*"\nplace = [0.25, 0.5]\n')
    out = tmp_path / "clicked"
    options = f"--mask.options={tmp_path / 'clicks.toml'}"
    assert main(["masks", str(foreign), "--source=click", options, TOP, f"--out={out}"]) == 0
    assert places == [((48, 64, 3), 0.5, 0.25)] * 2  # once for an episode
    expected = np.zeros((48, 64), bool)
    expected[:24, :16] = True
    dataset = LeRobotDataset("someone/so101", root=out, video_backend="pyav")
    assert np.array_equal(dataset[5][MASK_KEY].numpy()[0] > 0.5, expected)
    assert json.loads((out / PROVENANCE_PATH).read_text())["source"] == "click"


@pytest.mark.skipif(importlib.util.find_spec("transformers") is None, reason="the extra masks")
def test_words_become_masks_of_somebody_elses_dataset_by_the_real_classes(foreign, tmp_path):
    """With the command of the pages and weights of another path; theirs are random and tiny."""
    tiny_models.save_grounding_dino(tmp_path / "dino")
    tiny_models.save_sam2(tmp_path / "sam2")
    (tmp_path / "sam.toml").write_text(
        f'threshold = 0.0\ntext_threshold = 0.0\n[detector]\nname = "{tmp_path / "dino"}"\n'
        f'[segmenter]\nname = "{tmp_path / "sam2"}"\n'
    )
    flags = ["--source=grounded_sam", "--mask.text=the red block", f"--mask.options={tmp_path / 'sam.toml'}"]
    assert main(["masks", str(foreign), *flags, TOP, f"--out={tmp_path / 'out'}"]) == 0
    dataset = LeRobotDataset("someone/so101", root=tmp_path / "out", video_backend="pyav")
    assert set(np.unique(dataset[5][MASK_KEY].numpy())) == {0.0, 1.0}
    noted = json.loads((tmp_path / "out" / PROVENANCE_PATH).read_text())
    assert noted["text"] == "the red block"
    facts = [episode["masks"][0] for episode in noted["episodes"]]
    assert [(each["words"], each["detector"], each["segmenter"]) for each in facts] == [
        ("the red block", "dino", "sam2")
    ] * 2


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--source=oracle"], "asks a simulator"),
        (["--source=geometry"], "needs the place of the target"),
        (["--source=vlm_dig"], "chooses where to act by itself"),
        (["--source=manual", "--mask.text=red"], "does not read"),
        (["--source=oracle", "--mask.text=red"], "does not read"),
        (["--source=crystal_ball"], "crystal_ball"),
        ([], "--source is missing"),
    ],
)
def test_what_cannot_be_is_refused(foreign, tmp_path, capsys, flags, words):
    camera = ["--main_camera=observation.images.top"]
    assert main(["masks", str(foreign), *flags, *camera, f"--out={tmp_path / 'out'}"]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_after_a_refusal_other_options_may_be_tried(foreign, tmp_path):
    camera, out = "observation.images.top", tmp_path / "out"
    with pytest.raises(ConfigurationError, match="no mask with key"):
        make_masks(foreign, out, source="manual", options=drawn(tmp_path, "episode/7"), main_camera=camera)
    (tmp_path / "other").mkdir()
    options = drawn(tmp_path / "other", "*")
    assert make_masks(foreign, out, source="manual", options=options, main_camera=camera) == 2


def test_a_camera_that_is_not_there_is_named(foreign, small_datasets, tmp_path):
    options = drawn(tmp_path, "*")
    with pytest.raises(DatasetError, match=r"observation\.images\.main is no camera of .*observation\.images\.top"):
        make_masks(foreign, tmp_path / "out", source="manual", options=options)
    with pytest.raises(ConfigurationError, match="has no effect"):
        make_masks(small_datasets["image"], tmp_path / "out", source="oracle", main_camera="observation.images.cab")


@pytest.mark.slow
@pytest.mark.parametrize("env", ["excavator", "fr5_grasp"])
def test_depth_makes_the_masks_of_demonstrations_which_then_pass_the_check(env, tmp_path):
    fast = ["--env.fidelity=fast"] if env == "excavator" else []
    demos = [f"--env.type={env}", *fast, "--env.episode_length=6", "--scenes=1", "--keep_failures", "--workers=0"]
    assert main(["demos", *demos, f"--out={tmp_path / 'shown'}"]) == 0
    assert main(["masks", str(tmp_path / "shown"), "--source=geometry", f"--out={tmp_path / 'by_depth'}"]) == 0
    assert check_dataset(tmp_path / "by_depth", replays=1).has_passed
    shown, by_depth = masks_of(tmp_path / "shown"), masks_of(tmp_path / "by_depth")
    assert np.logical_and(shown, by_depth).sum() > 0.6 * np.logical_or(shown, by_depth).sum()


def test_other_options_or_another_dataset_are_no_continuation(small_datasets, foreign, tmp_path, monkeypatch):
    root, out = small_datasets["image"], tmp_path / "out"
    monkeypatch.setattr(make_masks_module, "write_with_masks", lambda *_: None)
    options = drawn(tmp_path, "*")
    with pytest.raises(DatasetError, match="is not a LeRobot dataset"):  # the copy was not written
        make_masks(root, out, source="manual", options=options)
    (tmp_path / "drawn.toml").write_text((tmp_path / "drawn.toml").read_text().replace("0.25", "0.3"))
    with pytest.raises(DatasetError, match="was not begun by this command with these options"):
        make_masks(root, out, source="manual", options=options)


@pytest.mark.parametrize("content", ["", "[]", '{"a": 1}\n{"b"}\n'])
def test_a_file_that_is_damaged_is_named(small_datasets, tmp_path, content):
    (tmp_path / "out.masks.jsonl").write_text(content)
    with pytest.raises(DatasetError, match=r"out\.masks\.jsonl"):
        make_masks(small_datasets["image"], tmp_path / "out", source="oracle")


def test_a_copy_within_the_dataset_and_one_text_for_all_targets_are_refused(paired_dataset, tmp_path):
    with pytest.raises(ConfigurationError, match="lies within"):
        make_masks(paired_dataset, paired_dataset / "masked", source="oracle")
    with pytest.raises(ConfigurationError, match="the same thing for all targets"):
        make_masks(paired_dataset, tmp_path / "out", source="grounded_sam", text="the red block")


@pytest.mark.parametrize("text", ["block #2", "no", "007", "red: block"])
def test_a_text_is_taken_as_it_stands(foreign, tmp_path, monkeypatch, text):
    told = {}
    monkeypatch.setattr(
        "lerobot_excav.datasets.masks.make_masks.make_masks", lambda *_, **options: told.update(options)
    )
    main(["masks", str(foreign), "--source=grounded_sam", f"--mask.text={text}", f"--out={tmp_path / 'out'}"])
    assert told["text"] == text


@pytest.mark.slow
def test_masks_of_blocks_are_snapped_onto_them_and_the_provenance_says_so(tmp_path):
    demos = ["--env.type=fr5_grasp", "--env.episode_length=6", "--scenes=1", "--keep_failures", "--workers=0"]
    assert main(["demos", *demos, f"--out={tmp_path / 'shown'}"]) == 0
    asked = ["--source=oracle", "--mask.snap=true", f"--out={tmp_path / 'snapped'}"]
    assert main(["masks", str(tmp_path / "shown"), *asked]) == 0
    shown, snapped = masks_of(tmp_path / "shown"), masks_of(tmp_path / "snapped")
    assert not np.array_equal(shown, snapped)
    assert np.logical_and(shown, snapped).sum() > 0.8 * np.logical_or(shown, snapped).sum()
    noted = json.loads((tmp_path / "snapped" / PROVENANCE_PATH).read_text())
    assert noted["snap"] is True
    assert {mask["snap"] for episode in noted["episodes"] for mask in episode["masks"]} == {"snapped"}


@pytest.mark.slow
def test_there_is_nothing_to_snap_to_on_the_ground(tmp_path, capsys):
    demos = ["--env.type=excavator", "--env.fidelity=fast", "--env.episode_length=6", "--scenes=1", "--workers=0"]
    assert main(["demos", *demos, "--keep_failures", f"--out={tmp_path / 'shown'}"]) == 0
    asked = ["--source=oracle", "--mask.snap=true", f"--out={tmp_path / 'snapped'}"]
    assert main(["masks", str(tmp_path / "shown"), *asked]) == 2
    assert "no use on the ground" in capsys.readouterr().err
    assert not (tmp_path / "snapped").exists()
