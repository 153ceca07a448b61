"""The overlay of scores."""

import numpy as np

from lerobot_excav.envs.tasks.planner.plan import plan_targets
from lerobot_excav.envs.tasks.planner.score_overlay import with_scores


def test_scores_colour_the_pile_and_nothing_else(see, worksite, renderer):
    surface = see(0)
    picture, depth_m, camera = renderer.render("main"), renderer.depth_m("main"), renderer.camera("main")
    shown = with_scores(picture, depth_m, camera, surface=surface, plan=plan_targets(surface))
    changed = (shown != picture).any(axis=-1)
    points_w = camera.points_w(depth_m)
    on_map = surface.covers(points_w)
    soil = on_map & (worksite.soil.height_at(np.where(on_map[..., None], points_w, 0.0)[..., :2]) > 0.02)
    assert changed.sum() > 0.5 * soil.sum()
    assert not changed[~on_map].any()
    # Where the best places are it is yellow, and the choice is tinted red.
    assert not np.shares_memory(shown, picture)


def test_no_place_no_colour(see, renderer):
    surface = see(0)
    picture, depth_m, camera = renderer.render("main"), renderer.depth_m("main"), renderer.camera("main")
    plan = plan_targets(surface, [(-3.0, -3.0, 3.0, 3.0)])
    assert np.array_equal(with_scores(picture, depth_m, camera, surface=surface, plan=plan), picture)
