"""Which regions the planner proposes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.machines.excavator.constants import MACHINE_POS_W
from lerobot_excav.envs.tasks.planner.candidates import LEAST_SWEPT_M3, LONGEST_ONSET_M, RADIUS_RANGE_M
from lerobot_excav.envs.tasks.planner.keep_out import is_barred
from lerobot_excav.envs.tasks.planner.plan import plan_targets
from lerobot_excav.envs.tasks.scoop.targets import LEAST_DISTANCE_M

from .conftest import surface_of, surface_of_scene

scenes = st.integers(0, 10_000)


def centers(plan):
    return np.array([target.center_w for target in plan.targets]).reshape(-1, 3)


@settings(max_examples=15, deadline=None)
@given(scenes)
def test_proposals_are_ranked_in_reach_apart_and_worth_it(scene_id):
    plan = plan_targets(surface_of_scene("train", scene_id))
    assert 1 <= len(plan.proposals) <= 4
    assert plan.nothing_left is None
    scores = [proposal.score for proposal in plan.proposals]
    assert scores == sorted(scores, reverse=True)
    assert scores[0] == plan.candidates.score[plan.candidates.is_possible].max()
    places_w = centers(plan)
    radius = np.hypot(*(places_w[:, :2] - MACHINE_POS_W[:2]).T)
    assert ((RADIUS_RANGE_M[0] <= radius) & (radius <= RADIUS_RANGE_M[1])).all()
    for number, place_w in enumerate(places_w):
        others = np.delete(places_w, number, axis=0)
        assert (np.hypot(*(others[:, :2] - place_w[:2]).T) >= LEAST_DISTANCE_M).all()
    for proposal in plan.proposals:
        assert proposal.swept_m3 >= LEAST_SWEPT_M3
        assert proposal.onset_m <= LONGEST_ONSET_M
        assert set(proposal.reason) == {"swept_m3", "onset_m", "radius_m", "seen_share", "vain_tries", "score"}


@settings(max_examples=10, deadline=None)
@given(scenes)
def test_the_same_surface_gives_the_same_plan_and_its_mirror_image_the_mirrored_one(scene_id):
    surface = surface_of_scene("train", scene_id)
    # The machine's axis is y = 0.
    mirrored = surface_of(surface.heights_m[:, ::-1].copy())
    first, again, other = (plan_targets(each) for each in (surface, surface, mirrored))
    assert np.array_equal(centers(first), centers(again))
    np.testing.assert_allclose(centers(other)[0] * [1.0, -1.0, 1.0], centers(first)[0], atol=1e-9)


def test_bare_ground_is_left_alone_and_the_plan_says_why():
    plan = plan_targets(surface_of(np.full((60, 60), 0.01)))
    assert plan.proposals == ()
    assert "less than 0.03 m3" in plan.nothing_left


def test_soil_is_dug_where_it_is_and_not_on_the_bare_ground_around():
    heights_m = np.zeros((60, 60))
    heights_m[30:40, 10:20] = 0.4  # x from 0 to 1 m, y from -2 to -1 m
    for place_w in centers(plan_targets(surface_of(heights_m))):
        assert -0.1 < place_w[0] < 1.2
        assert -2.2 < place_w[1] < -0.8


def test_a_thin_film_is_not_worth_a_cycle_and_a_ridge_behind_the_region_is_not_its_own():
    heights_m = np.full((60, 60), 0.02)
    heights_m[20:24] = 0.5  # a ridge across the cuts
    plan = plan_targets(surface_of(heights_m))
    # The cut may run through the ridge, but loading has to begin within the region.
    assert all(place_w[0] < -0.4 for place_w in centers(plan))


def test_what_is_not_seen_is_not_dug():
    surface = surface_of_scene("train", 0)
    hidden = surface_of(surface.heights_m, np.zeros((60, 60), dtype=bool))
    plan = plan_targets(hidden)
    assert plan.proposals == ()
    assert "hidden" in plan.nothing_left


@settings(max_examples=15, deadline=None)
@given(scenes, st.floats(-2.5, 2.0), st.floats(-2.5, 2.0), st.floats(0.05, 2.0), st.floats(0.05, 2.0))
def test_no_region_and_no_cut_path_touches_a_keep_out_zone(scene_id, x, y, width, depth):
    surface = surface_of_scene("train", scene_id)
    zone = (x, y, x + width, y + depth)
    plan = plan_targets(surface, [zone])
    for target in plan.targets:
        # A dense sample of the region and of the way from it towards the machine.
        radius = np.hypot(*(target.center_w[:2] - MACHINE_POS_W[:2]))
        along, across = np.meshgrid(np.arange(2.0 - radius, 0.4, 0.02), np.arange(-0.4, 0.41, 0.02))
        cos, sin = np.cos(target.yaw_rad), np.sin(target.yaw_rad)
        x_w = target.center_w[0] + along * cos - across * sin
        y_w = target.center_w[1] + along * sin + across * cos
        assert not ((zone[0] < x_w) & (x_w < zone[2]) & (zone[1] < y_w) & (y_w < zone[3])).any()


def test_a_zone_on_the_first_choice_moves_it_and_a_zone_on_everything_leaves_nothing():
    surface = surface_of_scene("train", 1)
    first_w = centers(plan_targets(surface))[0]
    x, y = first_w[:2]
    moved = plan_targets(surface, [(x - 0.1, y - 0.1, x + 0.1, y + 0.1)])
    assert np.hypot(*(centers(moved)[0] - first_w)[:2]) > 0.3
    nothing = plan_targets(surface, [(-3.0, -3.0, 3.0, 3.0)])
    assert nothing.proposals == ()
    assert "are barred by keep_out" in nothing.nothing_left


def test_a_zone_far_away_changes_nothing():
    surface = surface_of_scene("train", 1)
    assert np.array_equal(centers(plan_targets(surface, [(8.0, 8.0, 9.0, 9.0)])), centers(plan_targets(surface)))


def test_a_zone_between_region_and_machine_bars_it():
    place_w = np.array([[1.0, 0.0, 0.3]])
    for zone, barred in (((-1.5, -0.1, -1.0, 0.1), True), ((-1.5, 0.5, -1.0, 0.6), False), ((1.5, -1, 2, 1), False)):
        assert is_barred(place_w, [zone], inner_radius_m=2.5, half_size_m=0.4).tolist() == [barred]


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(scenes, st.integers(1, 4))
def test_regions_that_brought_nothing_come_after_all_others_and_the_least_tried_of_them_first(scene_id, tries):
    surface = surface_of_scene("train", scene_id)
    first = plan_targets(surface)
    vain_w = [first.targets[0].center_w] * tries
    plan = plan_targets(surface, vain_w=vain_w)
    away_m = np.hypot(*(centers(plan)[:, :2] - vain_w[0][:2]).T)
    assert [proposal.vain_tries for proposal in plan.proposals] == [tries if m < 0.8 else 0 for m in away_m]
    assert away_m[0] >= 0.8
    everywhere = [*plan.candidates.centers_w[::7], *vain_w]
    again = plan_targets(surface, vain_w=everywhere)
    counts = again.candidates.vain_tries[again.candidates.is_possible]
    assert again.proposals[0].vain_tries == counts.min()


def test_a_pile_that_was_tried_in_vain_all_over_is_still_worth_a_cycle():
    surface = surface_of_scene("train", 0)
    first = plan_targets(surface)
    again = plan_targets(surface, vain_w=list(first.candidates.centers_w))
    assert again.nothing_left is None
    assert (again.candidates.is_possible == first.candidates.is_possible).all()
