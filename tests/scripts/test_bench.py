import json

import pytest

from lerobot_excav.evaluation import speed
from lerobot_excav.evaluation.speed import Measurement
from lerobot_excav.scripts.main import main


def test_the_soil_is_measured_and_written(tmp_path, capsys):
    assert main(["bench", "--quick", "--only=soil", f"--json={tmp_path / 'new' / 'bench.json'}"]) == 0
    assert "soil alone" in capsys.readouterr().out
    written = json.loads((tmp_path / "new" / "bench.json").read_text())
    assert written["measurements"][0]["unit"] == "x real time"
    assert written["measurements"][0]["value"] > 0.0


@pytest.mark.slow
def test_writing_is_measured(capsys):
    assert main(["bench", "--quick", "--only=writing"]) == 0
    assert "frames/s" in capsys.readouterr().out


def test_options_reach_the_measurements(monkeypatch, capsys):
    asked = []

    def measures(*, workers):
        return {
            name: lambda quick, name=name: (
                asked.append((name, quick, workers)),
                [Measurement(name=name, value=1.0, unit="")],
            )[1]
            for name in ("soil", "environment", "writing", "demos", "policy")
        }

    monkeypatch.setattr(speed, "measures", measures)
    main(["bench", "--only=demos,policy", "--workers=3"])
    main(["bench", "--quick"])
    assert asked[:2] == [("demos", False, 3), ("policy", False, 3)]
    assert asked[2:] == [(name, True, 2) for name in ("soil", "environment", "writing", "demos", "policy")]


def test_an_unknown_measurement_is_named(capsys):
    assert main(["bench", "--only=mud"]) == 2
    assert "--only='mud'" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--quick", "--only=soil", "--json=x.json", "--workers=3"])
def test_options_of_the_machine_are_refused_for_the_operator(option, tmp_path, capsys):
    assert main(["bench", option, "operator", f"--metrics={tmp_path / 'm'}", "--scenes=1"]) == 2
    assert f"{option.partition('=')[0]} " in capsys.readouterr().err
    assert not (tmp_path / "m").exists()


def test_the_arms_operator_plays_scenes(tmp_path, capsys):
    metrics = tmp_path / "operator.jsonl"
    options = ["--scenes=1", "--targets=1", "--episode-length=4", "--workers=0", f"--metrics={metrics}"]
    assert main(["bench", "operator", "--env=fr5_grasp", *options]) == 0
    (line,) = map(json.loads, metrics.read_text().splitlines())
    assert (line["task"], line["scene_set"], line["operator"]) == ("FR5Grasp-v0", "test", "scripted")
    assert "target selection [%]" in capsys.readouterr().out
