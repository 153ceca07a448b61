from itertools import product

import pytest

from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.envs.tasks.settings import FIDELITIES, SOILS
from lerobot_excav.errors import DatasetError
from lerobot_excav.evaluation.fuzz.actions import STYLES
from lerobot_excav.evaluation.fuzz.case import Episode, Failure, FuzzCase, play, replay

FAILING_TICK = 23
"""In the fifth frame of an episode."""


@pytest.fixture
def leaking_soil(monkeypatch):
    """Let the soil lose a gram after a while."""
    tick = Worksite.tick

    def leak(self, action):
        reaction = tick(self, action)
        if round(50 * self.time_s) == FAILING_TICK:
            self.soil._out_of_bounds_kg += 1e-3
        return reaction

    monkeypatch.setattr(Worksite, "tick", leak)


def test_all_soils_fidelities_and_styles_take_turns():
    count = len(SOILS) * len(FIDELITIES) * len(STYLES)
    cases = [FuzzCase(seed=0, number=number, steps=1) for number in range(count)]
    assert {(c.soil, c.fidelity, c.style) for c in cases} == set(product(SOILS, FIDELITIES, STYLES))


def test_a_sound_case_ends_without_a_failure():
    assert play(FuzzCase(seed=0, number=12, steps=20)) is None


def test_a_failure_says_when_and_what(leaking_soil):
    failure = play(FuzzCase(seed=0, number=1, steps=10))
    assert failure.step == 5
    assert failure.problem.startswith("the ledger is off by 0.001 kg")
    assert failure.case == "case 1 of seed 0 (gravel, fast, noise)"


def test_a_case_repeats(leaking_soil):
    first, second = (play(FuzzCase(seed=3, number=12, steps=10)) for _ in range(2))
    assert first == second
    assert play(FuzzCase(seed=4, number=12, steps=10)).episodes != first.episodes


def test_a_failure_that_was_written_repeats(leaking_soil, tmp_path):
    failure = play(FuzzCase(seed=0, number=12, steps=10))
    failure.write(tmp_path / "new" / "failure.json")
    restored = Failure.read(tmp_path / "new" / "failure.json")
    assert restored == failure
    assert replay(restored) == failure.problem


def test_a_mended_failure_is_gone(tmp_path):
    episode = Episode(scene_id=0, target_id=1, actions=[[0.0, 1.0, 0.0, 0.0]] * 3)
    failure = Failure(case="x", problem="p", soil="sand", fidelity="fast", episodes=[episode])
    assert replay(failure) == ""


def test_some_cases_are_reset_in_the_middle(leaking_soil, monkeypatch):
    monkeypatch.setattr(f"{__name__}.FAILING_TICK", 10**9)
    import lerobot_excav.evaluation.fuzz.case as module

    begun = []
    begin = module._begin
    monkeypatch.setattr(
        module, "_begin", lambda env, episode: (begun.append(episode), begin(env, episode))[1]
    )
    for number in range(6):
        play(FuzzCase(seed=0, number=number, steps=2))
    assert 6 < len(begun) <= 12


@pytest.mark.parametrize("text", ["{", "{}", '{"episodes": [], "colour": 1}'])
def test_a_file_that_is_no_failure_is_refused(tmp_path, text):
    (tmp_path / "f.json").write_text(text)
    with pytest.raises(DatasetError, match="no failure"):
        Failure.read(tmp_path / "f.json")


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(DatasetError, match="does not exist"):
        Failure.read(tmp_path / "f.json")
