"""What is written below a tile of a video grid."""

import json

import pytest

from lerobot_excav.envs.tasks.clear.measures import ClearRecord
from lerobot_excav.envs.tasks.scoop.measures import ScoopRecord

from ..conftest import SCOOP, line


@pytest.mark.parametrize(
    ("outcome", "words"),
    [
        ({}, "dug in the region, 300 kg"),
        ({"is_success": False, "retained_mass_kg": 99.6}, "dug in the region, 100 kg"),
        ({"is_success": False, "target_success": False}, "dug elsewhere, 300 kg"),
        ({"is_success": False, "target_success": False, "retained_mass_kg": 0.4}, "brought nothing"),
    ],
)
def test_a_scoop_says_where_it_dug_and_what_it_brought(outcome, words):
    record = ScoopRecord.model_validate_json(json.dumps(line(SCOOP, 0, **outcome)))
    assert record.outcome_words == words


@pytest.mark.parametrize(
    ("removed", "words"), [(0.767, "77 % removed"), (1.0, "100 % removed"), (-0.003, "0 % removed")]
)
def test_a_pile_says_how_much_of_it_is_gone(removed, words):
    assert ClearRecord.model_construct(pile_removed=removed).outcome_words == words
