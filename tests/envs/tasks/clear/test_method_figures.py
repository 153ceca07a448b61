"""Pictures that set methods beside each other which cleared the same piles."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lerobot_excav.envs.tasks.clear import method_figures
from lerobot_excav.envs.tasks.clear.cycle_record import FAILURES, MISSED
from lerobot_excav.envs.tasks.clear.measures import ClearRecord
from lerobot_excav.envs.tasks.clear.spec import CYCLES

METRICS = Path("results", "clear", "operator_val.jsonl")


@pytest.fixture(scope="module")
def piles():
    lines = METRICS.read_text().splitlines()[:3]
    return [ClearRecord.model_validate_json(json.dumps(json.loads(line))) for line in lines]


def test_a_pile_that_ends_early_keeps_what_it_has_reached(piles):
    short = piles[0].model_copy(update={"cycles": piles[0].cycles[:4]})
    removed = method_figures.removed_by_cycle(short)
    assert removed.shape == (CYCLES + 1,)
    assert removed[0] == 0.0
    assert removed[1:5].tolist() == [cycle.pile_removed for cycle in short.cycles]
    assert np.all(removed[5:] == short.cycles[-1].pile_removed)
    assert method_figures.removed_by_cycle(short.model_copy(update={"cycles": ()})).tolist() == [0.0] * (CYCLES + 1)


def test_every_cycle_is_counted_once_by_what_came_of_it(piles):
    missed = piles[0].cycles[0].model_copy(update={"failure": MISSED})
    pile = piles[0].model_copy(update={"cycles": (missed, *piles[0].cycles[1:4])})
    shares = method_figures.failure_shares([pile])
    assert shares[0] == 0.75
    assert shares[1 + FAILURES.index(MISSED)] == 0.25
    assert sum(method_figures.failure_shares(piles)) == pytest.approx(1.0)
    assert method_figures.failure_shares([]) == [0.0] * (1 + len(FAILURES))


@pytest.mark.parametrize("draw", ["draw_progress", "draw_failures", "draw_same_pile"])
def test_pictures_are_drawn_of_one_method_and_of_several(piles, tmp_path, draw):
    for methods in ({"a": piles}, {"a": piles, "b": piles[1:], "c": piles[2:]}):
        getattr(method_figures, draw)(methods, tmp_path / "figure.png")
        assert Image.open(tmp_path / "figure.png").width > 300


@pytest.mark.parametrize("changes", [{"scene_id": 7}, {"pile": "ridge"}, {"soil": "gravel"}])
def test_methods_without_a_common_pile_are_said_to_have_none(piles, tmp_path, changes):
    other = piles[0].model_copy(update=changes)
    method_figures.draw_same_pile({"a": piles[:1], "b": [other]}, tmp_path / "figure.png")
    method_figures.draw_same_pile({"a": piles[:1], "b": piles[1:]}, tmp_path / "none.png")
    assert (tmp_path / "figure.png").read_bytes() == (tmp_path / "none.png").read_bytes()
