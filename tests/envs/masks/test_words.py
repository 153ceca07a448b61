"""Masks from words: the real classes of transformers with tiny random weights, and golden numbers made by hand."""

import importlib.util
import re
import shutil
import sys
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.envs.masks.grounding import GROUNDING_DINO, Detection, Detector, clipped, phrase
from lerobot_excav.envs.masks.model_files import ModelName, Placement, load
from lerobot_excav.envs.masks.segment_anything import SAM2, SegmentAnything
from lerobot_excav.envs.masks.vision_language import QWEN
from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.errors import ConfigurationError

from . import tiny_models

pytestmark = pytest.mark.skipif(importlib.util.find_spec("transformers") is None, reason="the extra masks")

HERE = Placement(download=False, device="cpu")
PICTURE = np.random.default_rng(0).integers(0, 255, (96, 128, 3), dtype=np.uint8)
START = {"scene_id": 3, "target_id": 1}


@pytest.fixture(scope="module")
def weights(tmp_path_factory):
    folder = tmp_path_factory.mktemp("weights")
    tiny_models.save_grounding_dino(folder / "dino")
    tiny_models.save_sam2(folder / "sam2")
    return folder


@pytest.fixture
def options(weights, tmp_path):
    def _write(extra=""):
        path = tmp_path / "masks.toml"
        path.write_text(
            f'threshold = 0.0\ntext_threshold = 0.0\n{extra}\n[detector]\nname = "{weights}/dino"\n'
            f'[segmenter]\nname = "{weights}/sam2"\n'
        )
        return {"mask_source": "grounded_sam", "mask_options": str(path)}

    return _write


def detector(weights, threshold=0.0):
    return Detector(ModelName(name=str(weights / "dino")), HERE, threshold=threshold, text_threshold=threshold)


def test_words_lead_to_a_box_within_the_picture(weights):
    found = detector(weights).find(PICTURE, "The red block")
    left, upper, right, lower = found.box
    assert 0.0 <= left < right <= 128.0
    assert 0.0 <= upper < lower <= 96.0
    assert detector(weights, threshold=1.0).find(PICTURE, "the red block") is None


def test_of_two_boxes_the_better_one_is_taken_and_each_axis_has_its_own_scale(weights):
    found = detector(weights, threshold=0.3)
    processor, _ = found._load()
    tokens = processor.tokenizer("the red block.").input_ids
    logits = torch.full((1, 2, 256), -10.0)
    logits[0, 0, : len(tokens)], logits[0, 1, : len(tokens)] = 0.0, 2.0
    boxes = torch.tensor([[[0.2, 0.2, 0.1, 0.1], [0.5, 0.25, 0.2, 0.1]]])  # middle, width and height as shares
    answer = SimpleNamespace(logits=logits, pred_boxes=boxes)
    found._loaded = processor, lambda **_: answer
    detection = found.find(PICTURE, "the red block")
    assert detection.box == pytest.approx((51.2, 19.2, 76.8, 28.8))
    assert detection.score == pytest.approx(1.0 / (1.0 + np.exp(-2.0)))


def test_logits_of_a_square_become_pixels_of_a_picture_that_is_none(weights):
    segmenter = SegmentAnything(ModelName(name=str(weights / "sam2")), HERE)
    processor, _ = segmenter._load()
    logits = torch.full((1, 1, 1, 32, 32), -10.0)
    logits[..., 8:16, :16] = 10.0  # the second quarter from above, the left half
    asked = {}

    def model(**inputs):
        asked.update(inputs)
        return SimpleNamespace(pred_masks=logits)

    segmenter._loaded = processor, model
    pixels = segmenter.pixels(PICTURE, (32.0, 24.0, 64.0, 48.0))
    expected = np.zeros((96, 128), bool)
    expected[24:48, :64] = True
    assert (pixels ^ expected).mean() < 0.01
    box = asked["input_boxes"].flatten().tolist()  # 128 x 128 for the model: 1.0 times the columns, 4/3 times the rows
    assert box == pytest.approx([32.0, 32.0, 64.0, 64.0])


def test_the_real_sam2_marks_pixels_of_the_picture_that_it_is_given(weights):
    for picture in (PICTURE, np.repeat(np.repeat(PICTURE, 4, axis=0), 4, axis=1)):
        height, width = picture.shape[:2]
        box = (0.25 * width, 0.25 * height, 0.5 * width, 0.5 * height)
        marked = [SegmentAnything(ModelName(name=str(weights / "sam2")), HERE).pixels(picture, box) for _ in range(2)]
        assert marked[0].shape == (height, width)
        assert marked[0].dtype == bool
        assert np.array_equal(*marked)


def test_the_whole_chain_of_real_classes_shows_a_mask_on_the_arm(options):
    """Nothing is replaced here: random weights find some box, and mark something in it."""
    env = FR5GraspEnv(render_mode=None, scene_set="val", **options())
    env.reset(options=START)
    assert env.mask.source == "grounded_sam"
    assert env.mask.pixels.shape == (96, 128)
    assert env.mask.pixels.any()
    assert (env.mask.parameters["detector"], env.mask.parameters["segmenter"]) == ("dino", "sam2")
    left, upper, right, lower = env.mask.parameters["box"]
    assert 0.0 <= left < right <= 512.0
    assert 0.0 <= upper < lower <= 384.0
    env.close()


@pytest.mark.parametrize(
    "make", [pytest.param(lambda **s: ExcavatorEnv(fidelity="fast", **s), marks=pytest.mark.slow), FR5GraspEnv]
)
def test_the_chain_runs_in_both_machines_once_for_a_scene(make, options, monkeypatch):
    asked, find = [], Detector.find
    monkeypatch.setattr(Detector, "find", lambda self, *given: asked.append(given) or find(self, *given))
    monkeypatch.setattr(SegmentAnything, "pixels", filled_box)
    env = make(render_mode=None, scene_set="val", **options())
    env.reset(options=START)
    for _ in range(3):
        env.step(env.holding_action())
    assert len(asked) == 1
    assert asked[0][0].shape == (384, 512, 3)
    env.close()


def filled_box(self, picture, box):
    pixels = np.zeros(picture.shape[:2], bool)
    left, upper, right, lower = (round(edge) for edge in box)
    pixels[upper:lower, left:right] = True
    return pixels


def test_a_block_is_looked_for_by_its_colour_and_its_box_is_filled(options, monkeypatch):
    asked = []

    def find(self, picture, words):
        asked.append(words)
        return Detection((100.0, 80.0, 140.0, 120.0), 0.9, words)

    monkeypatch.setattr(Detector, "find", find)
    monkeypatch.setattr(SegmentAnything, "pixels", filled_box)
    env = FR5GraspEnv(render_mode=None, scene_set="val", **options())
    names = set()
    for target_id in range(4):
        env.reset(options={"scene_id": 3, "target_id": target_id})
        rows, columns = np.nonzero(env.mask.pixels)
        assert (rows.min(), rows.max(), columns.min(), columns.max()) == (20, 29, 25, 34)
        assert env.mask.parameters["words"] == asked[-1] == f"the {env.scene.colour_name(target_id)} block"
        names.add(asked[-1])
    assert len(names) == 4
    env.close()


def test_words_of_the_options_come_before_those_of_the_task(options, monkeypatch):
    asked = []
    monkeypatch.setattr(Detector, "find", lambda self, picture, words: asked.append(words))
    env = FR5GraspEnv(render_mode=None, scene_set="val", episode_length=3, **options('text = "a purple block"'))
    env.reset(options=START)
    assert asked == ["a purple block"]
    assert env.mask is None  # and the machine waits
    env.close()


def test_in_sand_depth_tells_the_region_and_the_mask_of_the_pile_bounds_it(options, monkeypatch):
    whole = np.zeros((384, 512), bool)
    monkeypatch.setattr(Detector, "find", lambda *_: Detection((0.0, 0.0, 512.0, 384.0), 0.9, "sand"))
    monkeypatch.setattr(SegmentAnything, "pixels", lambda *_: whole)
    env = ExcavatorEnv(fidelity="fast", render_mode=None, scene_set="val", **options())
    shown = ExcavatorEnv(fidelity="fast", render_mode=None, scene_set="val", mask_source="geometry")
    shown.reset(options=START)
    rows, columns = np.nonzero(shown.mask.pixels)
    middle = round(columns.mean())
    whole[:, : 4 * middle] = True
    env.reset(options=START)
    expected = shown.mask.pixels.copy()
    expected[:, middle:] = False
    assert (env.mask.pixels ^ expected).sum() <= rows.max() - rows.min() + 1
    facts = env.mask.parameters
    assert 0 < facts["inside_px"] < facts["patch_px"] < facts["whole_px"]
    for each in (env, shown):
        each.close()


@pytest.mark.parametrize(
    ("words", "expected"),
    [("The Red Block", "the red block."), ("a. B .", "a. b."), (" sand. ", "sand.")],
)
def test_phrases_are_lower_case_and_end_with_a_full_stop(words, expected):
    assert phrase(words) == expected


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=4, max_size=4))
def test_a_box_lies_in_the_picture_or_is_none(edges):
    box = clipped(edges, (96, 128))
    if box is not None:
        left, upper, right, lower = box
        assert 0.0 <= left <= right - 1.0 <= 127.0
        assert 0.0 <= upper <= lower - 1.0 <= 95.0


@pytest.mark.parametrize("name", ["nowhere/to-be-found", "."])
def test_weights_that_are_not_here_are_named(name):
    lost = Detector(ModelName(name=name), HERE, threshold=0.3, text_threshold=0.3)
    with pytest.raises(ConfigurationError, match=rf"the weights '{name}' cannot be loaded: .* download = true"):
        lost.find(PICTURE, "sand")


def test_without_the_library_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "transformers", None)
    with pytest.raises(ConfigurationError, match=r"pip install 'lerobot_env_excav\[masks\]'"):
        SegmentAnything(ModelName(name="x"), HERE).pixels(PICTURE, (0.0, 0.0, 9.0, 9.0))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("threshold = 2.0", "threshold"),
        ('[detector]\nnam = "x"', r"detector\.nam"),
        ("model = 3", "takes text, detector, segmenter"),
    ],
)
def test_wrong_options_are_named(tmp_path, text, words):
    (tmp_path / "o.toml").write_text(text)
    with pytest.raises(ConfigurationError, match=words):
        FR5GraspEnv(render_mode=None, mask_source="grounded_sam", mask_options=str(tmp_path / "o.toml"))


def test_provenance_names_a_folder_by_its_last_part_and_a_revision(weights):
    assert ModelName(name=str(weights / "dino")).words == "dino"
    assert ModelName(name="a/b", revision="abc").words == "a/b@abc"


@pytest.mark.parametrize("default", [GROUNDING_DINO, SAM2, QWEN])
def test_default_weights_are_of_one_commit_however_they_are_named(default):
    assert re.fullmatch(r"[0-9a-f]{40}", default.revision)
    assert ModelName.model_validate({"name": default.name}) == default
    assert ModelName(name=default.name, revision="main").revision == "main"
    assert ModelName(name=default.name + "-2").revision is None  # the commit of one repository means nothing in another


def test_the_commit_reaches_the_loader():
    asked = {}

    def loader(name, **options):
        asked.update(options, name=name)

    load(loader, SAM2, download=True)
    assert asked == {"name": SAM2.name, "revision": SAM2.revision, "local_files_only": False}


def test_weights_of_another_model_are_refused(weights):
    swapped = SegmentAnything(ModelName(name=str(weights / "dino")), HERE)
    with pytest.raises(ConfigurationError, match=r"cannot be loaded|are of another model"):
        swapped.pixels(PICTURE, (0.0, 0.0, 9.0, 9.0))


def test_damaged_weights_and_a_device_that_is_not_there_are_named(weights, tmp_path):
    shutil.copytree(weights / "sam2", tmp_path / "sam2")
    path = tmp_path / "sam2" / "model.safetensors"
    path.write_bytes(path.read_bytes()[:100])
    with pytest.raises(ConfigurationError, match="cannot be loaded"):
        SegmentAnything(ModelName(name=str(tmp_path / "sam2")), HERE).pixels(PICTURE, (0.0, 0.0, 9.0, 9.0))
    nowhere = Placement(download=False, device="gpu")
    with pytest.raises(ConfigurationError, match="device='gpu' is not possible"):
        SegmentAnything(ModelName(name=str(weights / "sam2")), nowhere).pixels(PICTURE, (0.0, 0.0, 9.0, 9.0))


def test_another_picture_of_the_same_scene_is_looked_at_again(options, monkeypatch):
    asked = []
    monkeypatch.setattr(Detector, "find", lambda self, picture, words: asked.append(words))
    env = FR5GraspEnv(render_mode=None, scene_set="val", episode_length=2, **options())
    env.reset(options=START)
    env.reset(options={"scene_id": 4, "target_id": 1})
    assert len(asked) == 2
    env.close()


def test_words_that_say_nothing_are_refused():
    with pytest.raises(ConfigurationError, match="say nothing to look for"):
        phrase(" . ")
