import dataclasses

import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.layout import cylinder_from_world
from lerobot_excav.envs.machines.excavator.rendering import WorksiteRenderer
from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.soil import PRESETS
from lerobot_excav.envs.tasks.scoop.feasibility import LEAST_MASK_PX, RADIUS_RANGE_M
from lerobot_excav.envs.tasks.scoop.pile import PILE_MASS_RANGE_KG, PILES
from lerobot_excav.envs.tasks.scoop.scene import SOIL_CELL_SIZE_M, cell_centres_w, draw_scene
from lerobot_excav.envs.tasks.scoop.settings import ExcavatorSettings
from lerobot_excav.envs.tasks.scoop.targets import LEAST_DISTANCE_M
from lerobot_excav.envs.tasks.settings import SCENE_SETS, TARGETS_PER_SCENE
from lerobot_excav.errors import ConfigurationError

SCENES = [(scene_set, scene_id) for scene_set in SCENE_SETS for scene_id in range(4)]
SHAPED = [("val", scene_id, pile) for pile in PILES if pile != "heaps" for scene_id in range(2)]


@pytest.fixture(scope="module", params=[*SCENES, *SHAPED], ids=lambda p: "-".join(map(str, p)))
def scene(request):
    scene_set, scene_id, *pile = request.param
    return draw_scene(scene_set, scene_id, **({"pile": pile[0]} if pile else {}))


def arrays_of(scene):
    return [scene.heights_m, scene.joint_pos, *(target.center_w for target in scene.targets)]


def test_same_number_gives_the_same_scene_byte_for_byte_which_cannot_be_changed():
    a = draw_scene("val", 11)
    draw_scene.cache_clear()
    b = draw_scene("val", 11)
    assert a is not b
    assert a.appearance == b.appearance
    for of_a, of_b in zip(arrays_of(a), arrays_of(b), strict=True):
        assert of_a.tobytes() == of_b.tobytes()
        with pytest.raises(ValueError, match="read-only"):
            of_a[0] = 1.0


@pytest.mark.slow
def test_scene_sets_share_no_scene_and_every_soil_preset_makes_another_pile():
    scenes = [draw_scene(*of) for of in SCENES] + [draw_scene("train", 0, soil=s) for s in PRESETS if s != "sand"]
    assert len({scene.heights_m.tobytes() for scene in scenes}) == len(scenes)


def test_pile_has_a_mass_in_its_range_is_at_rest_and_keeps_off_the_border(scene):
    sand = PRESETS["sand"]
    mass_kg = scene.heights_m.sum() * SOIL_CELL_SIZE_M**2 * sand.density_kg_m3
    assert PILE_MASS_RANGE_KG[0] - 1 <= mass_kg <= PILE_MASS_RANGE_KG[1] + 1
    rise = max(np.abs(np.diff(scene.heights_m, axis=axis)).max() for axis in (0, 1))
    assert rise <= SOIL_CELL_SIZE_M * sand.slope_tan * 1.02
    border = np.concatenate([scene.heights_m[[0, -1]].ravel(), scene.heights_m[:, [0, -1]].ravel()])
    assert border.max() == 0.0


def test_targets_are_four_reachable_apart_and_on_the_soil(scene):
    x_w, y_w = cell_centres_w()
    assert len(scene.targets) == TARGETS_PER_SCENE
    for i, target in enumerate(scene.targets):
        assert RADIUS_RANGE_M[0] <= cylinder_from_world(target.center_w)[0] <= RADIUS_RANGE_M[1]
        for other in scene.targets[:i]:
            assert np.hypot(*(target.center_w - other.center_w)[:2]) >= LEAST_DISTANCE_M
        ix, iy = np.argmin(np.abs(x_w - target.center_w[0])), np.argmin(np.abs(y_w - target.center_w[1]))
        assert target.center_w[2] == scene.heights_m[ix, iy] > 0.0


def crest_spread_m(scene):
    """Standard deviations along x and y of the places of the highest tenth of a pile [m]."""
    x_w, y_w = cell_centres_w()
    ix, iy = np.nonzero(scene.heights_m >= np.quantile(scene.heights_m[scene.heights_m > 0.0], 0.9))
    return np.std(x_w[ix]), np.std(y_w[iy])


def test_the_shape_of_a_pile_is_the_one_asked_for():
    y_w = cell_centres_w()[1]
    for scene_id in range(4):
        heaps, two, ridge = (draw_scene("val", scene_id, pile=pile) for pile in PILES)
        assert heaps.heights_m.tobytes() == draw_scene("val", scene_id).heights_m.tobytes()
        across = two.heights_m.max(axis=0)  # a summit on either side of a saddle
        middle = np.abs(y_w) < 0.5
        summits = across[y_w < 0.0].max(), across[y_w > 0.0].max()
        assert 0.1 < across[middle].min() < 0.7 * min(summits)
        along = ridge.heights_m.max(axis=0)[np.abs(y_w) < 0.8]
        assert along.min() > 0.8 * along.max()  # one crest, without a saddle
        assert crest_spread_m(ridge)[1] > 1.5 * crest_spread_m(ridge)[0]


@pytest.mark.parametrize(("density", "factor"), [("light", 0.8), ("usual", 1.0), ("heavy", 1.2)])
def test_a_soil_of_another_density_differs_from_its_preset_in_nothing_else(density, factor):
    settings = ExcavatorSettings(density=density, soil="gravel")
    parameters = settings.dug_soil if density != "usual" else PRESETS[settings.dug_soil]
    assert parameters == dataclasses.replace(PRESETS["gravel"], density_kg_m3=factor * PRESETS["gravel"].density_kg_m3)


@pytest.mark.parametrize("soil", ["sand", "gravel", "dirt", "wet_sand"])
def test_a_pile_has_the_mass_of_a_pile_at_the_density_of_its_preset(soil):
    volume_m3 = draw_scene("val", 2, soil=soil).heights_m.sum() * SOIL_CELL_SIZE_M**2
    assert PILE_MASS_RANGE_KG[0] - 1 <= volume_m3 * 1474.0 <= PILE_MASS_RANGE_KG[1] + 1


@pytest.mark.slow
@pytest.mark.parametrize("soil", PRESETS)
@pytest.mark.parametrize("pile", PILES)
def test_every_soil_in_every_shape_of_pile_offers_its_regions(soil, pile):
    for scene_id in range(25):
        assert len(draw_scene("val", scene_id, soil=soil, pile=pile).targets) == TARGETS_PER_SCENE


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


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"scene_set": "eval"}, "'train', 'val', 'test'"),
        ({"scene_id": -1}, "scene_id=-1"),
        ({"soil": "mud"}, "'sand'"),
        ({"pile": "heap"}, "'two_heaps', 'ridge'"),
    ],
)
def test_bad_arguments_name_the_field_and_what_is_allowed(changes, named):
    with pytest.raises(ConfigurationError, match=named):
        draw_scene(**{"scene_set": "train", "scene_id": 0, **changes})
