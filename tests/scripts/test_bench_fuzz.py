import pytest

from lerobot_excav.envs.machines.excavator.worksite import Worksite
from lerobot_excav.scripts.main import main


@pytest.fixture
def leaking_soil(monkeypatch):
    """Let the soil lose a gram in every tick."""
    tick = Worksite.tick

    def leak(self, action):
        self.soil._out_of_bounds_kg += 1e-3
        return tick(self, action)

    monkeypatch.setattr(Worksite, "tick", leak)


def test_a_clean_fuzz_ends_with_code_0(tmp_path, capsys):
    assert main(["bench", "fuzz", "--steps=8", "--workers=0", f"--out={tmp_path}"]) == 0
    assert "8 steps, 0 failures" in capsys.readouterr().out


def test_a_failure_is_written_and_repeats(leaking_soil, tmp_path, capsys):
    arguments = ["--steps=8", "--first-case=3", "--seed=5", "--workers=0"]
    assert main(["bench", "fuzz", *arguments, f"--out={tmp_path}"]) == 1
    path = tmp_path / "seed5_case3.json"
    assert f"--replay={path}" in capsys.readouterr().out
    assert main(["bench", "fuzz", f"--replay={path}"]) == 1
    assert "case 3 of seed 5 (wet_sand, fast, noise), step 1: the ledger" in capsys.readouterr().out


def test_a_mended_failure_ends_with_code_0(tmp_path, capsys):
    with pytest.MonkeyPatch.context() as patch:
        tick = Worksite.tick

        def leak(self, action):
            self.soil._out_of_bounds_kg += 1e-3
            return tick(self, action)

        patch.setattr(Worksite, "tick", leak)
        main(["bench", "fuzz", "--steps=8", "--workers=0", f"--out={tmp_path}"])
    assert main(["bench", "fuzz", f"--replay={tmp_path / 'seed0_case0.json'}"]) == 0
    assert "now: nothing is wrong" in capsys.readouterr().out


def test_a_replay_takes_no_other_option(tmp_path, capsys):
    assert main(["bench", "fuzz", "--replay=x.json", "--steps=3", "--seed=1"]) == 2
    assert "--steps, --seed has no effect" in capsys.readouterr().err
