"""Masks that need no simulator's knowledge, of both machines: by depth, and by what a person has marked in a file."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.envs.masks.manual import polygon_pixels
from lerobot_excav.envs.masks.object_pixels import object_by_colour, object_by_depth
from lerobot_excav.envs.masks.shot import Shot, reduced
from lerobot_excav.envs.tasks.clear.env import ClearEnv
from lerobot_excav.envs.tasks.grasp.env import FR5GraspEnv
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.errors import ConfigurationError

MAKE = {"excavator": lambda **s: ExcavatorEnv(fidelity="fast", **s), "fr5": FR5GraspEnv}
START = {"scene_id": 3, "target_id": 1}


def iou(a, b):
    return np.logical_and(a, b).sum() / np.logical_or(a, b).sum()


@pytest.fixture(scope="module", params=MAKE)
def oracle(request):
    """An environment that knows its targets."""
    env = MAKE[request.param](render_mode=None, scene_set="val")
    env.reset(options=START)
    env.name = request.param
    yield env
    env.close()


@pytest.fixture
def make(oracle):
    made = []

    def _make(**settings):
        made.append(MAKE[oracle.name](render_mode=None, scene_set="val", **settings))
        made[-1].reset(options=START)
        return made[-1]

    yield _make
    for env in made:
        env.close()


def options(tmp_path, text):
    path = tmp_path / "options.toml"
    path.write_text(text)
    return {"mask_source": "manual", "mask_options": str(path)}


def middle(pixels):
    rows, columns = np.nonzero(pixels)
    return (columns.mean() + 0.5) / pixels.shape[1], (rows.mean() + 0.5) / pixels.shape[0]


@pytest.mark.parametrize("scene_id", [0, 7])
@pytest.mark.parametrize("target_id", range(4))
def test_depth_alone_finds_what_the_simulator_knows(oracle, make, scene_id, target_id):
    env = make(mask_source="geometry")
    for each in (env, oracle):
        each.reset(options={"scene_id": scene_id, "target_id": target_id})
    assert env.mask.source == "geometry"
    assert iou(env.mask.pixels, oracle.mask.pixels) > 0.75


def test_a_click_marks_the_target_that_is_there(oracle, make, tmp_path):
    oracle.reset(options=START)
    x, y = middle(oracle.mask.pixels)
    env = make(**options(tmp_path, f'[[mask]]\nkey = "val/3/0/1"\nclick = [{x}, {y}]\n'))
    assert env.mask.source == "manual"
    assert iou(env.mask.pixels, oracle.mask.pixels) > 0.6  # of a region, the click is not its exact middle


def test_a_polygon_is_shown_as_it_was_drawn(make, tmp_path):
    env = make(
        **options(tmp_path, '[[mask]]\nkey = "*"\npolygon = [[0.25, 0.25], [0.75, 0.25], [0.75, 0.5], [0.25, 0.5]]\n')
    )
    expected = np.zeros((96, 128), bool)
    expected[24:48, 32:96] = True
    assert np.array_equal(env.mask.pixels, expected)


def test_an_entry_of_its_own_comes_before_the_one_for_all(make, tmp_path):
    text = '[[mask]]\nkey = "*"\npolygon = [[0, 0], [0.5, 0], [0.5, 0.5]]\n'
    text += '[[mask]]\nkey = "val/3/0/1"\npolygon = [[0.5, 0.5], [1, 0.5], [1, 1]]\n'
    env = make(**options(tmp_path, text))
    assert env.mask.parameters["key"] == "val/3/0/1"
    env.reset(options={"scene_id": 3, "target_id": 2})
    assert env.mask.parameters["key"] == "*"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[[mask]]\nkey = "val/9/0/0"\nclick = [0.5, 0.5]', r"no mask with key = 'val/3/0/1'"),
        (
            '[[mask]]\nkey = "a"\nclick = [0.5, 0.5]\n[[mask]]\nkey = "a"\nclick = [0.5, 0.5]',
            "two masks have the key a",
        ),
        ('[[mask]]\nkey = "a"', "give a polygon, a click or a box"),
        ('[[mask]]\nkey = "a"\nclick = [0.5, 1.5]', r"mask\.0\.click\.1"),
        ('[[mask]]\nkey = "a"\nclick = [0.5, nan]', r"mask\.0\.click\.1"),
        ('[[mask]]\nkey = "a"\npolygon = [[0, 0], [1, 1]]', r"mask\.0\.polygon"),
        ("colour = 3", "takes mask"),
        ("", "needs masks"),
        ("[", "is no TOML file"),
    ],
)
def test_a_wrong_file_says_what_is_wrong(tmp_path, text, words):
    settings = options(tmp_path, text)
    with pytest.raises(ConfigurationError, match=words):
        FR5GraspEnv(render_mode=None, scene_set="val", **settings).reset(options=START)


def test_a_file_that_is_missing_or_has_no_effect_is_refused(tmp_path):
    with pytest.raises(ConfigurationError, match="cannot be read"):
        FR5GraspEnv(mask_source="manual", mask_options=str(tmp_path / "none.toml"))
    with pytest.raises(ConfigurationError, match="needs masks"):
        FR5GraspEnv(mask_source="manual")
    with pytest.raises(ConfigurationError, match="'oracle' has no options"):
        FR5GraspEnv(mask_options=str(tmp_path / "none.toml"))


def test_the_machine_is_no_soil():
    env = ExcavatorEnv(fidelity="fast", render_mode=None, scene_set="val", mask_source="geometry")
    env.reset(options=START)
    place_w, shot = env.worksite.machine.cutting_edge_pos_w, env.shot()
    under = np.array([*place_w[:2], env.worksite.soil.height_at(place_w[:2])])
    points_w = shot.points_w()
    machine = np.linalg.norm(points_w - place_w, axis=-1) < 0.3
    assert machine.any()
    assert not (env.patch(under, shot) & machine).any()
    env.close()


@given(
    st.integers(1, 6), st.integers(1, 6), st.integers(1, 5), st.integers(1, 5), st.randoms(use_true_random=False)
)  # fmt: skip
def test_a_reduced_mask_holds_the_pixels_that_are_mostly_covered(height, width, up, across, rng):
    fine = np.array([[rng.random() < 0.5 for _ in range(width * across)] for _ in range(height * up)])
    shares = fine.reshape(height, up, width, across).mean(axis=(1, 3))
    found = reduced(fine, (height, width))
    clear = np.abs(shares - 0.5) > 1e-9
    assert np.array_equal(found[clear], (shares > 0.5)[clear])


def test_a_polygon_covers_its_area():
    triangle = polygon_pixels([(0.1, 0.1), (0.9, 0.1), (0.1, 0.9)], (96, 128))
    assert triangle.mean() == pytest.approx(0.5 * 0.8**2, rel=0.02)


def test_colour_finds_a_block_in_a_large_picture_and_nothing_beside_the_picture():
    env = FR5GraspEnv(render_mode=None, scene_set="val")
    env.reset(options=START)
    shot = env.shot()
    known = object_by_depth(shot, env.place_w(env.command))
    rows, columns = np.nonzero(known)
    box = (columns.min() - 6, rows.min() - 6, columns.max() + 6, rows.max() + 6)
    assert iou(object_by_colour(shot.picture, box), known) > 0.8
    assert not object_by_colour(shot.picture, (-20, -20, 1, 1)).any()
    env.close()


def test_a_picture_without_depth_or_calibration_says_so():
    picture = np.zeros((4, 4, 3), np.uint8)
    with pytest.raises(ConfigurationError, match="has no depth"):
        Shot(picture=picture).points_w()
    with pytest.raises(ConfigurationError, match="not calibrated"):
        Shot(picture=picture, depth_m=np.ones((4, 4), np.float32)).points_w()


def test_settings_of_masks_go_into_files(tmp_path):
    settings = options(tmp_path, '[[mask]]\nkey = "*"\nclick = [0.5, 0.5]\n')
    env = FR5GraspEnv(render_mode=None, **settings)
    assert json.loads(json.dumps(env.settings.as_dict()))["mask_options"] == settings["mask_options"]


@pytest.mark.slow
def test_a_scene_that_was_dug_looks_as_at_first_when_it_is_shown_again():
    env = ExcavatorEnv(fidelity="fast", render_mode=None, scene_set="val", mask_source="geometry")
    env.reset(options=START)
    first, depth_m = env.mask.pixels.copy(), env.shot().depth_m
    operator = env.task_spec.make_operator(np.random.default_rng(0))
    operator.reset(env)
    for _ in range(90):  # until a bucket of soil is gone
        env.step(operator.act(env))
    assert env.cycle.state.bucket_mass_kg > 100.0
    env.reset(options=START)
    assert np.array_equal(env.shot().depth_m, depth_m)
    assert np.array_equal(env.mask.pixels, first)
    env.close()


def test_a_box_marks_the_object_that_fills_it(tmp_path):
    env = FR5GraspEnv(render_mode=None, scene_set="val")
    env.reset(options=START)
    rows, columns = np.nonzero(env.mask.pixels)
    box = (columns.min() - 2) / 128, (rows.min() - 2) / 96, (columns.max() + 3) / 128, (rows.max() + 3) / 96
    boxed = FR5GraspEnv(
        render_mode=None,
        scene_set="val",
        **options(tmp_path, f'[[mask]]\nkey = "*"\nbox = {[float(b) for b in box]}\n'),
    )
    boxed.reset(options=START)
    assert iou(boxed.mask.pixels, env.mask.pixels) > 0.7
    for each in (env, boxed):
        each.close()


def test_a_click_that_hits_nothing_is_an_error(make, tmp_path):
    with pytest.raises(ConfigurationError, match=r"the click .* hits nothing that can be commanded"):
        make(**options(tmp_path, '[[mask]]\nkey = "*"\nclick = [0.5, 0.01]\n'))


@pytest.mark.slow
def test_every_cycle_of_clearing_has_a_key_of_its_own(tmp_path):
    polygons = {0: "[[0, 0], [0.5, 0], [0.5, 0.5]]", 1: "[[0.5, 0.5], [1, 0.5], [1, 1]]"}
    text = "".join(f'[[mask]]\nkey = "val/3/0/0/{cycle}"\npolygon = {shape}\n' for cycle, shape in polygons.items())
    env = ClearEnv(fidelity="fast", render_mode=None, scene_set="val", **options(tmp_path, text))
    env.reset(options={"scene_id": 3})
    assert env.mask.parameters["key"] == "val/3/0/0/0"
    while not env.clearing.records:  # the machine stands still until the cycle's time is over
        env.step(env.holding_action())
    assert env.mask.parameters["key"] == "val/3/0/0/1"
    env.close()


def test_a_source_that_fails_at_a_change_of_command_leaves_no_old_mask(tmp_path):
    text = '[[mask]]\nkey = "val/3/0/1"\npolygon = [[0, 0], [0.5, 0], [0.5, 0.5]]\n'
    env = FR5GraspEnv(render_mode=None, scene_set="val", retarget_frame=1, **options(tmp_path, text))
    env.reset(options=START)
    with pytest.raises(ConfigurationError, match="no mask with key"):
        env.step(env.holding_action())
    assert env.mask is None
    with pytest.raises(ConfigurationError, match="no mask with key"):
        env.reset(options={"scene_id": 9, "target_id": 0})
    with pytest.raises(ConfigurationError, match=r"call reset\(\) first"):
        env.step(env.holding_action())
    env.close()


def test_results_name_the_options_by_file_and_digest_and_not_by_place(tmp_path):
    settings = options(tmp_path, '[[mask]]\nkey = "*"\npolygon = [[0, 0], [1, 0], [1, 1]]\n')
    env = FR5GraspEnv(render_mode=None, episode_length=1, **settings)
    env.reset(options=START)
    *_, info = env.step(env.holding_action())
    words = info["episode_metrics"]["mask_options"]
    assert words.startswith("options.toml (")
    assert str(tmp_path) not in words
    env.close()
