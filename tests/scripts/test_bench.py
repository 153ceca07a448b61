import json

import pytest

from lerobot_excav.evaluation import speed
from lerobot_excav.evaluation.speed import Measurement
from lerobot_excav.scripts.bench import MEASURES
from lerobot_excav.scripts.main import main

TOY = ("bench", "--env.type=toy_reach", "--scenes=1", "--targets=1", "--workers=0")


def test_everything_is_measured_and_written(tmp_path, capsys):
    assert main([*TOY, f"--json={tmp_path / 'new' / 'bench.json'}"]) == 0
    written = json.loads((tmp_path / "new" / "bench.json").read_text())["measurements"]
    text = capsys.readouterr().out
    assert all(each["value"] > 0.0 and each["name"] in text for each in written)
    assert {each["unit"] for each in written} == {"steps/s", "x real time", "frames/s", "episodes/min"}


def test_a_file_that_exists_is_kept_and_named_before_anything_is_measured(tmp_path, capsys):
    (tmp_path / "mine.json").write_text("years of work")
    assert main([*TOY, f"--json={tmp_path / 'mine.json'}"]) == 2
    assert "mine.json exists; choose another file, or remove it first" in capsys.readouterr().err
    assert (tmp_path / "mine.json").read_text() == "years of work"


def test_options_reach_the_measurements(monkeypatch):
    asked = []

    def measures(settings, *, workers):
        return {name: lambda name=name: (asked.append((name, settings, workers)), [Measurement(name, 1.0, "")])[1]
                for name in MEASURES}  # fmt: skip

    monkeypatch.setattr(speed, "measures", measures)
    main([*TOY, "--only=demos", "--env.table=ice"])
    main(["bench", "--workers=3"])
    assert [(name, workers) for name, _, workers in asked] == [("demos", 0), *((name, 3) for name in MEASURES)]
    (_, toy, _), (_, excavator, _), *_ = asked
    assert (toy.env.table, toy.scenes, toy.keep_failures) == ("ice", 1, True)
    assert (excavator.env.ENV_TYPE, excavator.scenes) == ("excavator", 3)


@pytest.mark.parametrize("only", ["mud", "soil"])
def test_an_unknown_measurement_is_named(only, capsys):
    assert main(["bench", f"--only={only}"]) == 2
    assert f"--only='{only}' is not possible; give one of environment" in capsys.readouterr().err
