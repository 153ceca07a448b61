"""A vision-language model chooses where to dig: what it may answer, and what becomes of it."""

import importlib.util
import json
import logging
import re
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.datasets.record.demonstrations import record_demonstrations
from lerobot_excav.envs.masks.model_files import ModelName, Placement
from lerobot_excav.envs.masks.segment_anything import SegmentAnything
from lerobot_excav.envs.masks.vision_language import Answer, VisionLanguageModel
from lerobot_excav.envs.tasks.clear.env import ClearEnv
from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
from lerobot_excav.envs.tasks.planner.depth_picture import depth_picture
from lerobot_excav.envs.tasks.planner.dig_answer import (
    UnusableAnswerError,
    read_answer,
    require_diggable,
    require_reach,
)
from lerobot_excav.envs.tasks.planner.vlm_dig import REACH_M
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig

from ...masks import tiny_models

SIZE = (384, 512)
START = {"scene_id": 3, "target_id": 1}
VLM = {"mask_source": "vlm_dig", "fidelity": "fast", "render_mode": None, "scene_set": "val"}


@pytest.fixture
def answers(monkeypatch):
    """Let the model give answers that a test has put down, and SAM 2 see all of the picture."""
    given, asked = [], []

    def ask(self, pictures, question):
        asked.append((pictures, question))
        return Answer(given[min(len(asked), len(given)) - 1], SIZE)

    monkeypatch.setattr(VisionLanguageModel, "ask", ask)
    monkeypatch.setattr(SegmentAnything, "pixels", lambda self, picture, box: np.ones(picture.shape[:2], bool))
    return given, asked


def pixel_of(env, place_w):
    """Return column and row of the shot's pixel that shows the place best."""
    away = np.linalg.norm(env.shot().points_w() - place_w, axis=-1)
    row, column = np.unravel_index(np.nanargmin(away), away.shape)
    return int(column), int(row)


def box_around(column, row, half=12):
    return json.dumps({"box": [column - half, row - half, column + half, row + half], "reason": "much sand"})


@pytest.fixture(scope="module")
def liked():
    """The planner's best place of a scene, and where the shot shows it."""
    env = ClearEnv(**{**VLM, "mask_source": "geometry"})
    env.reset(options={"scene_id": 3})
    place_w = env.plan.proposals[0].target.center_w
    yield place_w, pixel_of(env, place_w)
    env.close()


def test_what_the_model_chooses_is_commanded_and_judged(answers, liked):
    given, asked = answers
    place_w, (column, row) = liked
    given.append("I think " + box_around(column, row) + " is best.")
    env = ExcavatorEnv(**VLM)
    env.reset(options=START)
    assert env.target_id == 1
    assert np.linalg.norm(env.target.center_w[:2] - place_w[:2]) < 0.1
    assert env.target.contains(env.places_w()[env.mask.pixels]).mean() > 0.9
    assert env.mask.parameters["reason"] == "much sand"
    pictures, question = asked[0]
    assert [picture.shape for picture in pictures] == [(*SIZE, 3), (*SIZE, 3)]
    assert "2.6 to 6.4 m" in question
    for _ in range(3):
        env.step(env.holding_action())
    assert len(asked) == 1  # never in the loop of control
    env.close()


@pytest.mark.parametrize(
    ("answer", "why"),
    [
        ("I cannot see an excavator.", "without JSON"),
        ('{"box": "left"}', "not what was asked for"),
        ('{"box": [600, 10, 700, 20]}', "beside the picture"),
        ('{"box": [5, 5, 5, 40]}', "beside the picture, or is empty"),
        (json.dumps({"box": [0, 0, 4, 4]}), "no soil"),
    ],
)
def test_what_cannot_be_done_is_left_to_the_planner_with_a_warning_and_counted(answers, caplog, liked, answer, why):
    answers[0].append(answer)
    env = ExcavatorEnv(**VLM, episode_length=2)
    with caplog.at_level(logging.WARNING):
        env.reset(options=START)
    assert "the planner chooses instead" in caplog.text
    assert re.search(why, caplog.text)
    assert np.linalg.norm(env.target.center_w[:2] - liked[0][:2]) < 0.2
    env.step(env.holding_action())
    *_, info = env.step(env.holding_action())
    assert info["episode_metrics"]["mask_fallbacks"] == 1
    env.close()


def test_keep_out_zones_bar_what_the_model_chooses(answers, liked, caplog):
    place_w, (column, row) = liked
    answers[0].append(box_around(column, row))
    x, y = place_w[:2]
    env = ClearEnv(**VLM, keep_out=f"{x - 0.3:.2f},{y - 0.3:.2f},{x + 0.3:.2f},{y + 0.3:.2f}")
    with caplog.at_level(logging.WARNING):
        env.reset(options={"scene_id": 3})
    assert "barred by keep_out" in caplog.text
    assert np.linalg.norm(env.target.center_w[:2] - place_w[:2]) > 0.3
    assert env.clearing.cycle.target is env.target
    env.close()


def test_in_clearing_the_chosen_place_is_what_the_cycle_is_judged_by(answers, liked):
    place_w, (column, row) = liked
    answers[0].append(box_around(column + 25, row))
    env = ClearEnv(**VLM)
    env.reset(options={"scene_id": 3})
    assert env.plan.proposals[0].target.center_w == pytest.approx(env.target.center_w)
    assert np.linalg.norm(env.target.center_w[:2] - place_w[:2]) > 0.1
    env.close()


def test_a_person_who_points_is_not_overruled(answers, liked):
    _, (column, row) = liked
    answers[0].append(box_around(column, row))
    env = ExcavatorEnv(**VLM)
    env.reset(options=START)
    env.recommand(0)
    assert env.mask.source == "geometry"
    assert env.target is env.scene.targets[0]
    env.close()


def test_nothing_can_be_recorded_with_it(tmp_path):
    settings = DemonstrationSettings.of("excavator", {"mask_source": "vlm_dig"}, scenes=1)
    with pytest.raises(ConfigurationError, match="chooses where to act by itself"):
        record_demonstrations(settings, tmp_path / "d", workers=0, show_progress=False)
    with pytest.raises(ConfigurationError, match=r"robot\.mask_source='vlm_dig' chooses"):
        ExcavatorSimConfig(mask_source="vlm_dig")
    with pytest.raises(ConfigurationError, match="mismatched"):
        ExcavatorEnv(**VLM, mask_condition="mismatched")


def test_the_arm_has_nothing_to_dig():
    env = FR5GraspEnv(render_mode=None, mask_source="vlm_dig")
    with pytest.raises(ConfigurationError, match="it needs an excavator"):
        env.reset(options=START)
    env.close()


def test_boxes_refer_to_the_resized_picture_axis_by_axis():
    answer = Answer('{"box": [14, 21, 70, 42], "reason": ""}', (84.0, 140.0))
    box, _ = read_answer(answer, (96, 128))
    assert box == pytest.approx((12.8, 24.0, 64.0, 48.0))
    box, _ = read_answer(Answer('{"box": [100, 250, 500, 750]}', (1000.0, 1000.0)), (96, 128))
    assert box == pytest.approx((12.8, 24.0, 64.0, 72.0))


@given(st.text() | st.text().map(lambda text: '{"box": ' + text + "}"))
def test_no_answer_does_more_than_be_unusable(text):
    try:
        box, reason = read_answer(Answer(text, (84.0, 140.0)), (96, 128))
    except UnusableAnswerError:
        pass
    else:
        assert len(box) == 4
        assert isinstance(reason, str)


def test_depth_is_light_where_it_is_near():
    picture = depth_picture(np.linspace(1.0, 5.0, 100, dtype=np.float32).reshape(10, 10))
    assert picture.shape == (10, 10, 3)
    assert (np.diff(picture[..., 0].ravel().astype(int)) <= 0).all()
    assert picture.max() == 255
    assert depth_picture(np.ones((4, 4), np.float32)).max() == 0


@pytest.mark.parametrize(("radius_m", "fits"), [(2.59, False), (2.61, True), (6.39, True), (6.41, False)])
def test_a_place_lies_where_the_bucket_reaches(radius_m, fits):
    if fits:
        require_reach(radius_m, REACH_M)
        return
    with pytest.raises(UnusableAnswerError, match=rf"its place is {radius_m:.1f} m away.*from 2\.6 to 6\.4 m"):
        require_reach(radius_m, REACH_M)


@pytest.mark.parametrize(
    ("changes", "why"),
    [({"is_barred": True}, "barred by keep_out"), ({"is_possible": False}, r"not worth a cycle: 0\.02 m3"), ({}, None)],
)
def test_a_place_is_dug_only_if_the_planner_would(changes, why):
    facts = {"is_barred": False, "is_possible": True, "swept_m3": 0.02, "onset_m": 0.5, "seen_share": 1.0, **changes}
    rated = SimpleNamespace(**{name: np.array([value]) for name, value in facts.items()})
    if why is None:
        require_diggable(rated)
        return
    with pytest.raises(UnusableAnswerError, match=why):
        require_diggable(rated)


needs_transformers = pytest.mark.skipif(importlib.util.find_spec("transformers") is None, reason="the extra masks")


@needs_transformers
def test_the_real_classes_look_at_a_pile_and_an_answer_of_noise_is_left_to_the_planner(tmp_path, caplog):
    """Nothing is replaced here: random weights say something, and it is no JSON."""
    tiny_models.save_qwen(tmp_path / "qwen")
    (tmp_path / "vlm.toml").write_text(f'most_tokens = 16\n[model]\nname = "{tmp_path / "qwen"}"\n')
    env = ExcavatorEnv(**VLM, episode_length=1, mask_options=str(tmp_path / "vlm.toml"))
    with caplog.at_level(logging.WARNING):
        env.reset(options=START)
    assert "qwen: it answers without JSON" in caplog.text
    assert env.mask.pixels.any()
    *_, info = env.step(env.holding_action())
    assert info["episode_metrics"]["mask_fallbacks"] == 1
    env.close()


@needs_transformers
def test_the_real_sam2_bounds_the_region_that_a_model_has_chosen(tmp_path, liked, monkeypatch):
    _, (column, row) = liked
    monkeypatch.setattr(VisionLanguageModel, "ask", lambda *_: Answer(box_around(column, row), SIZE))
    tiny_models.save_sam2(tmp_path / "sam2")
    (tmp_path / "vlm.toml").write_text(f'[segmenter]\nname = "{tmp_path / "sam2"}"\n')
    env = ExcavatorEnv(**VLM, mask_options=str(tmp_path / "vlm.toml"))
    env.reset(options=START)
    facts = env.mask.parameters
    assert facts["reason"] == "much sand"
    assert 0 <= facts["inside_px"] <= min(facts["patch_px"], facts["whole_px"])
    assert env.mask.pixels.any()
    env.close()


def answers_of(folder, *, most_tokens, times=1):
    """Ask the model of a folder about two black pictures."""
    placement = Placement(download=False, device="cpu")
    model = VisionLanguageModel(ModelName(name=str(folder)), placement, most_tokens=most_tokens)
    picture = np.zeros((96, 128, 3), np.uint8)
    return [model.ask([picture, picture], "Where to dig?") for _ in range(times)]


@needs_transformers
def test_places_of_a_qwen3_are_thousandths_of_the_picture(tmp_path):
    tiny_models.save_qwen3(tmp_path / "qwen3")
    (answer,) = answers_of(tmp_path / "qwen3", most_tokens=4)
    assert answer.scale == (1000.0, 1000.0)


@needs_transformers
def test_the_real_classes_answer_about_two_pictures(tmp_path):
    tiny_models.save_qwen(tmp_path / "qwen")
    answer, again = answers_of(tmp_path / "qwen", most_tokens=16, times=2)
    assert answer.scale == (84.0, 140.0)  # multiples of 28 pixels
    assert again == answer
