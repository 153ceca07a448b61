"""Masks from clicks: what the source asks the network, and what it makes of the answer."""

from contextlib import closing

import numpy as np
import pytest

from lerobot_excav.datasets.clicks.clicked_scenes import clicked_scenes
from lerobot_excav.datasets.clicks.score import iou, score
from lerobot_excav.envs.masks.click.network import PICTURE_SIZE
from lerobot_excav.envs.masks.click.segmenter import BUILT_IN, ClickSegmenter
from lerobot_excav.envs.masks.picture_view import PictureView
from lerobot_excav.envs.masks.source import make_mask_source
from lerobot_excav.envs.tasks.registry import env_types
from lerobot_excav.errors import ConfigurationError

ENVIRONMENTS = ("fr5_grasp", "excavator")


def env_of(env_type, **settings):
    return env_types()[env_type].make_env(render_mode=None, scene_set="val", mask_source="click", **settings)


def told(tmp_path, text):
    path = tmp_path / "click.toml"
    path.write_text(text)
    return str(path)


@pytest.fixture
def asked(monkeypatch):
    """Note where the network is asked; it marks a square of 40 x 40 pixels there."""
    places = []

    def pixels(self, picture, row, column):
        places.append((row, column))
        mask = np.zeros(PICTURE_SIZE, bool)
        at_row, at_column = int(row * PICTURE_SIZE[0]), int(column * PICTURE_SIZE[1])
        mask[max(0, at_row - 20) : at_row + 20, max(0, at_column - 20) : at_column + 20] = True
        return mask

    monkeypatch.setattr(ClickSegmenter, "pixels", pixels)
    return places


@pytest.mark.parametrize("env_type", ENVIRONMENTS)
def test_the_built_in_network_marks_most_of_every_target(env_type):
    scenes = clicked_scenes(env_type, "val", range(1000, 1006))  # not those of the reported score
    found = score(ClickSegmenter.load(BUILT_IN), scenes, np.random.default_rng(0))
    assert found.scenes == 6
    assert found.mean > 0.7
    assert found.share_above_half > 0.8


@pytest.mark.parametrize("env_type", ENVIRONMENTS)
def test_masks_of_an_environment_lie_on_the_commanded_target(env_type):
    with closing(env_of(env_type)) as env:
        for target_id in range(3):
            env.reset(options={"scene_id": 1001, "target_id": target_id})
            assert env.mask.source == "click"
            assert iou(env.mask.pixels, env.true_mask(env.command)) > 0.5
            assert set(env.mask.parameters) >= {"click", "trained_on", "steps"}


def test_a_file_says_where_was_clicked_for_a_situation_or_for_all(tmp_path, asked):
    file = told(
        tmp_path,
        '[[click]]\nkey = "val/3/0/1"\nplace = [0.25, 0.75]\n[[click]]\nkey = "*"\nplace = [0.5, 0.4]\n',
    )
    with closing(env_of("fr5_grasp", mask_options=file)) as env:
        env.reset(options={"scene_id": 3, "target_id": 1})
        rows, columns = np.nonzero(env.mask.pixels)
        assert (rows.mean() / 96, columns.mean() / 128) == pytest.approx((0.75, 0.25), abs=0.01)
        env.reset(options={"scene_id": 3, "target_id": 2})
    assert asked == [(0.75, 0.25), (0.4, 0.5)]


def test_missed_clicks_are_drawn_by_situation_with_the_spread_asked_for(tmp_path, asked):
    with closing(env_of("fr5_grasp")) as env:
        for scene_id in range(12):
            env.reset(options={"scene_id": scene_id, "target_id": 0})
    exact = np.array(asked)
    asked.clear()
    with closing(env_of("fr5_grasp", mask_options=told(tmp_path, "error_px = 2.0"))) as env:
        for scene_id in (*range(12), 0):
            env.reset(options={"scene_id": scene_id, "target_id": 0})
    missed_px = (np.array(asked[:12]) - exact) * (96, 128)
    assert 1.0 < missed_px.std() < 3.5
    assert asked[12] == asked[0]


def test_a_picture_alone_needs_a_click_of_its_own(tmp_path, asked):
    view = PictureView(np.zeros((60, 80, 3), np.uint8), key="episode/0", words="a block")
    with pytest.raises(ConfigurationError, match=r"no click with key = 'episode/0'"):
        make_mask_source("click").mask(view, None)
    file = told(tmp_path, '[[click]]\nkey = "episode/0"\nplace = [0.5, 0.5]\n')

    class Command:
        target_id = 0

    mask = make_mask_source("click", options=file).mask(view, Command())
    assert mask.pixels.shape == (60, 80)
    assert mask.pixels[30, 40]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[[click]]\nkey = "a"\nplace = [0.5, 1.5]', "less than or equal to 1"),
        ('[[click]]\nkey = "a"\nplace = [0.5, 0.5]\n' * 2, "two clicks have the key a"),
        ("error_px = -1.0", "greater than or equal to 0"),
        ("clicks = 3", "takes model, click, error_px"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused(tmp_path, text, words):
    with pytest.raises(ConfigurationError, match=words):
        make_mask_source("click", options=told(tmp_path, text))


def test_a_file_that_is_no_network_is_refused(tmp_path):
    (tmp_path / "other.safetensors").write_bytes(b"nothing of this kind")
    file = told(tmp_path, f'model = "{tmp_path}/other.safetensors"')
    view = PictureView(np.zeros((60, 80, 3), np.uint8), key="episode/0", words="a block")
    with pytest.raises(ConfigurationError, match="holds no click segmenter"):
        make_mask_source("click", options=file).segmenter.pixels(view.picture(), 0.5, 0.5)


def test_a_click_beside_the_picture_is_refused():
    with pytest.raises(ConfigurationError, match="beside the picture"):
        ClickSegmenter.load(BUILT_IN).pixels(np.zeros((96, 128, 3), np.uint8), 0.5, 1.2)
