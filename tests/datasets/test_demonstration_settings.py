from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.datasets.demonstration_settings import DemonstrationSettings
from lerobot_excav.errors import ConfigurationError


@given(first=st.integers(0, 50), scenes=st.integers(1, 40), targets=st.integers(1, 4))
def test_every_scene_is_shown_with_as_many_different_targets_as_asked_for(first, scenes, targets):
    settings = DemonstrationSettings(first_scene=first, scenes=scenes, targets=targets)
    pairs = settings.pairs()
    assert len(set(pairs)) == len(pairs) == scenes * targets
    assert set(Counter(pair.scene_id for pair in pairs).values()) == {targets}
    frequency = Counter(pair.target_id for pair in pairs)
    assert max(frequency.values()) - min(frequency[t] for t in range(4)) <= targets
    assert pairs == sorted(pairs)


def test_one_target_per_scene_goes_round_the_targets():
    pairs = DemonstrationSettings(scenes=8, targets=1).pairs()
    assert [pair.target_id for pair in pairs] == [0, 1, 2, 3, 0, 1, 2, 3]


def test_settings_read_back():
    settings = DemonstrationSettings(soil="gravel", scenes=7)
    assert DemonstrationSettings.from_record(settings.as_record(), source=Path("s.json")) == settings


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"colour": 1}, r"s\.json has other settings \(colour\)"),
        ({"simulation_version": 99}, r"s\.json is of version 99 of the simulation"),
    ],
)
def test_stored_settings_of_another_version_are_refused(changes, message):
    with pytest.raises(ConfigurationError, match=message):
        DemonstrationSettings.from_record(
            {**DemonstrationSettings().as_record(), **changes}, source=Path("s.json")
        )


def test_stored_settings_without_a_version_are_of_the_first():
    record = DemonstrationSettings().as_record()
    del record["simulation_version"]
    with pytest.raises(ConfigurationError, match="is of version 1 of the simulation, and this is version"):
        DemonstrationSettings.from_record(record, source=Path("s.json"))


@pytest.mark.parametrize(
    "changes",
    [
        {"env": "fr5"},
        {"task": "Dig-v9"},
        {"scene_set": "all"},
        {"soil": "mud"},
        {"fidelity": "exact"},
        {"fps": 12},
        {"height": 8},
        {"width": 5000},
        {"targets": 5},
        {"scenes": 0},
        {"first_scene": -1},
        {"seed": -1},
        {"episode_length": 0},
    ],
)
def test_a_value_out_of_range_is_named(changes):
    (field,) = changes
    with pytest.raises(ConfigurationError, match=f"--{field.replace('_', '-')}="):
        DemonstrationSettings(**changes)
