import pytest

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.evaluation.fuzz import run
from lerobot_excav.evaluation.fuzz.case import Episode, Failure
from lerobot_excav.evaluation.fuzz.run import cases, fuzz


@pytest.mark.parametrize("steps", [1, 399, 400, 401, 200_000])
def test_cases_add_up_to_the_steps(steps):
    assert sum(case.steps for case in cases(steps, 0, 0)) == steps


def test_a_later_first_case_goes_on_where_another_run_ended():
    assert list(cases(4000, 7, 0))[5:] == list(cases(2000, 7, 5))


def test_a_small_fuzz_of_the_real_environment_is_clean(tmp_path):
    assert fuzz(25, workers=0, out=tmp_path / "out", show_progress=False) == []
    assert not (tmp_path / "out").exists()


def test_failures_are_written_and_returned_in_order(tmp_path, monkeypatch):
    def play(case):
        episode = Episode(scene_id=0, target_id=0, actions=[[0.0] * 4])
        failure = Failure(case=str(case), problem="p", soil="sand", fidelity="fast", episodes=[episode])
        return failure if case.number % 2 else None

    monkeypatch.setattr(run, "play", play)
    failures = fuzz(1600, seed=2, first_case=10, workers=0, out=tmp_path, show_progress=False)
    assert [path.name for path, _ in failures] == ["seed2_case11.json", "seed2_case13.json"]
    assert [Failure.read(path) for path, _ in failures] == [failure for _, failure in failures]


@pytest.mark.parametrize("number", [{"steps": 0}, {"seed": -1}, {"first_case": -1}, {"workers": -1}])
def test_impossible_numbers_are_named(tmp_path, number):
    (name,) = number
    with pytest.raises(ConfigurationError, match=f"--{name.replace('_', '-')}="):
        fuzz(**{"steps": 10, "out": tmp_path, **number})
