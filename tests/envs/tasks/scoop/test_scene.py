import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.layout import cylinder_from_world
from lerobot_excav.envs.machines.excavator.rendering import WorksiteRenderer
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.soil import PRESETS
from lerobot_excav.envs.tasks.scoop.feasibility import LEAST_MASK_PX, RADIUS_RANGE_M
from lerobot_excav.envs.tasks.scoop.pile import PILE_MASS_RANGE_KG
from lerobot_excav.envs.tasks.scoop.scene import SOIL_CELL_SIZE_M, cell_centres_w, draw_scene
from lerobot_excav.envs.tasks.scoop.targets import LEAST_DISTANCE_M
from lerobot_excav.envs.tasks.settings import SCENE_SETS, TARGETS_PER_SCENE
from lerobot_excav.errors import ConfigurationError

SCENES = [(scene_set, scene_id) for scene_set in SCENE_SETS for scene_id in range(4)]


@pytest.fixture(scope="module", params=SCENES, ids=lambda p: f"{p[0]}-{p[1]}")
def scene(request):
    return draw_scene(*request.param)


def test_same_number_gives_the_same_scene_byte_for_byte():
    a = draw_scene("val", 11)
    draw_scene.cache_clear()
    b = draw_scene("val", 11)
    assert a is not b
    assert a.heights_m.tobytes() == b.heights_m.tobytes()
    assert a.joint_pos.tobytes() == b.joint_pos.tobytes()
    assert a.appearance == b.appearance
    assert all(np.array_equal(s.center_w, t.center_w) for s, t in zip(a.targets, b.targets, strict=True))


def test_a_kept_scene_cannot_be_changed():
    scene = draw_scene("val", 11)
    for array in (scene.heights_m, scene.joint_pos, scene.targets[0].center_w):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_scene_sets_share_no_scene():
    piles = {draw_scene(s, i).heights_m.tobytes() for s, i in SCENES}
    assert len(piles) == len(SCENES)


def test_pile_mass_is_in_its_range(scene):
    mass_kg = scene.heights_m.sum() * SOIL_CELL_SIZE_M**2 * PRESETS["sand"].density_kg_m3
    assert PILE_MASS_RANGE_KG[0] - 1 <= mass_kg <= PILE_MASS_RANGE_KG[1] + 1


def test_pile_is_at_rest(scene):
    rise = np.abs(np.diff(scene.heights_m, axis=0)).max(), np.abs(np.diff(scene.heights_m, axis=1)).max()
    assert max(rise) <= SOIL_CELL_SIZE_M * PRESETS["sand"].slope_tan * 1.02


def test_pile_keeps_off_the_border_of_the_dig_area(scene):
    border = np.concatenate([scene.heights_m[[0, -1]].ravel(), scene.heights_m[:, [0, -1]].ravel()])
    assert border.max() == 0.0


def test_targets_are_four_reachable_and_apart(scene):
    assert len(scene.targets) == TARGETS_PER_SCENE
    for i, target in enumerate(scene.targets):
        assert RADIUS_RANGE_M[0] <= cylinder_from_world(target.center_w)[0] <= RADIUS_RANGE_M[1]
        for other in scene.targets[:i]:
            assert np.hypot(*(target.center_w - other.center_w)[:2]) >= LEAST_DISTANCE_M


def test_targets_lie_on_the_soil_surface(scene):
    x_w, y_w = cell_centres_w()
    for target in scene.targets:
        ix, iy = np.argmin(np.abs(x_w - target.center_w[0])), np.argmin(np.abs(y_w - target.center_w[1]))
        assert target.center_w[2] == scene.heights_m[ix, iy] > 0.0


@pytest.mark.parametrize("soil", ["sand", "gravel"])
def test_every_target_has_a_mask_of_a_fair_number_of_pixels(soil):
    worksite = Worksite(soil=soil)
    renderer = WorksiteRenderer(worksite, height=96, width=128)
    for scene_set, scene_id in SCENES:
        scene = draw_scene(scene_set, scene_id, soil=soil)
        worksite.reset(scene)
        points_w = renderer.terrain_points_w()
        for target in scene.targets:
            # The picture has whole pixels and a coarser surface than the soil.
            assert target.contains(points_w).sum() >= 0.85 * LEAST_MASK_PX
    renderer.close()


@pytest.mark.parametrize("soil", PRESETS)
def test_every_soil_preset_makes_scenes(soil):
    assert draw_scene("train", 0, soil=soil).soil == soil


def test_soil_preset_changes_the_pile():
    assert not np.array_equal(draw_scene("train", 0).heights_m, draw_scene("train", 0, soil="wet_sand").heights_m)


@pytest.mark.parametrize(
    ("kwargs", "named"),
    [
        ({"scene_set": "eval", "scene_id": 0}, "'train', 'val', 'test'"),
        ({"scene_set": "train", "scene_id": -1}, "scene_id=-1"),
        ({"scene_set": "train", "scene_id": 0, "soil": "mud"}, "'sand'"),
    ],
)
def test_bad_arguments_name_the_field_and_what_is_allowed(kwargs, named):
    with pytest.raises(ConfigurationError, match=named):
        draw_scene(**kwargs)
