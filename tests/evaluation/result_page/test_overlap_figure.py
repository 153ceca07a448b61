import json
from pathlib import Path

import matplotlib.image
import pytest

from lerobot_excav.envs.tasks.grasp.measures import GraspRecord
from lerobot_excav.evaluation.result_page.overlap_figure import (
    draw_success_by_overlap,
    error_words,
    has_imprecise_masks,
    success_by_overlap,
)
from tests.evaluation.conftest import GRASP, line


def episode(iou, *, is_success=True, number=0, **settings):
    settings = {"mask_noise": "shift", "mask_noise_px": 2, **settings}
    return GraspRecord.model_validate_json(
        json.dumps({**line(GRASP, number), **settings, "mask_iou": iou, "is_success": is_success})
    )


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"mask_noise": "none", "mask_noise_px": 0}, ""),
        ({}, "shift"),
        ({"mask_snap": True}, "shift, snapped"),
        ({"mask_dropout": 0.2}, "shift, dropout"),
        ({"mask_noise": "none", "mask_noise_px": 0, "mask_dropout": 0.2}, "dropout"),
        ({"mask_noise": "none", "mask_noise_px": 0, "mask_snap": True}, ""),
        ({"mask_condition": "mismatched"}, ""),
        ({"commands": [[0, 0], [50, 1]], "target_id": 0}, ""),
    ],
)
def test_errors_have_a_name_whatever_their_size(settings, words):
    assert error_words(episode(0.5, **settings)) == words


def test_a_section_has_imprecise_masks_where_files_say_how_well_they_fit():
    exact = episode(1.0, mask_noise="none", mask_noise_px=0)
    assert has_imprecise_masks([exact, episode(0.4)])
    assert not has_imprecise_masks([exact, episode(None)])
    assert not has_imprecise_masks([])


def test_success_is_counted_in_tenths_of_the_overlap():
    episodes = [episode(0.0, is_success=False), episode(0.05), episode(0.95), episode(1.0), episode(None)]
    low, high = success_by_overlap(episodes)
    assert low[:2] == (pytest.approx(0.025), 2)
    assert low[2].estimate == 0.5
    assert high[:2] == (pytest.approx(0.975), 2)
    assert high[2].estimate == 1.0
    assert success_by_overlap([episode(None)]) == []


def test_an_episode_of_whose_mask_nothing_was_left_counts_as_no_overlap():
    lost = episode(None, is_success=False, mask_missing=True)
    assert [(x, number) for x, number, _ in success_by_overlap([lost, episode(0.9)])] == [(0.0, 1), (0.9, 1)]


def test_a_picture_is_drawn_also_of_a_kind_without_overlaps(tmp_path):
    rows = {"a": [episode(0.2), episode(0.8)], "b": [episode(None, mask_noise="erode")]}
    path = Path(tmp_path) / "page" / "overlap.png"
    draw_success_by_overlap(rows, path)
    assert matplotlib.image.imread(path).shape[:2] == (324, 720)
