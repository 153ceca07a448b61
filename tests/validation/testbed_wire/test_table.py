import json

import pytest

from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from validation.testbed_wire import __main__ as study
from validation.testbed_wire.rollout import Wire


def cycle(wire, scene_id, target_id, *, is_success):
    return {
        **wire._asdict(),
        "policy": study.CHECKPOINT.name,
        **{"scene_id": scene_id, "target_id": target_id, "simulation_version": SCOOP.simulation_version},
        **{"is_success": is_success, "target_success": True, "retained_mass_kg": 400.0},
    }


def test_the_table_counts_each_condition_by_itself():
    slow, lossy = Wire(100, 0.0), Wire(0, 0.2)
    rows = [
        (wire, [cycle(wire, 0, t, is_success=t < hits) for t in range(4)]) for wire, hits in ((slow, 1), (lossy, 4))
    ]
    lines = study.table(rows)[2:]
    assert lines[0].startswith("| 100 ms | 0% | 1 of 4, 25% [")
    assert lines[1].startswith("| 0 ms | 20% | 4 of 4, 100% [")
    assert all(line.endswith("| 400 kg |") for line in lines)


def test_what_is_finished_is_not_played_again_and_the_rest_goes_on_at_its_scene(tmp_path, monkeypatch, capsys):
    begun = []

    def played(wire, *, first_scene, count, **_):
        begun.append((wire, first_scene, count))
        yield from (cycle(wire, first_scene + i // 4, i % 4, is_success=True) for i in range(count))

    monkeypatch.setattr(study, "cycles_behind", played)
    monkeypatch.setattr(study, "late_ticks", lambda folder: "0 ticks took longer")
    options = ["--delays=0", "--losses=5", f"--file={tmp_path / 'wire.jsonl'}"]
    assert study.main(["--cycles=4", *options]) == 0
    assert study.main(["--cycles=12", *options]) == 0
    still, lossy = Wire(0, 0.0), Wire(0, 0.05)
    assert begun == [(still, 0, 4), (lossy, 0, 4), (still, 1, 4), (still, 2, 4), (lossy, 1, 4), (lossy, 2, 4)]
    lines = [json.loads(line) for line in (tmp_path / "wire.jsonl").read_text().splitlines()]
    assert sorted({line["scene_id"] for line in lines}) == [0, 1, 2]
    assert "12 of 12, 100%" in capsys.readouterr().out


def test_another_policy_is_another_study(tmp_path, monkeypatch, capsys):
    path = tmp_path / "wire.jsonl"
    path.write_text("".join(json.dumps(cycle(Wire(0, 0.0), 0, t, is_success=True)) + "\n" for t in range(4)))
    monkeypatch.setattr(study, "late_ticks", lambda folder: "")
    monkeypatch.setattr(
        study, "cycles_behind", lambda wire, **_: (cycle(wire, 0, t, is_success=False) for t in range(4))
    )
    assert study.main(["--cycles=4", "--delays=0", "--losses=", "--policy=another", f"--file={path}"]) == 0
    assert "0 of 4, 0%" in capsys.readouterr().out


@pytest.mark.parametrize("cycles", ["0", "5"])
def test_cycles_that_are_no_whole_scenes_are_refused(cycles, capsys):
    with pytest.raises(SystemExit):
        study.main([f"--cycles={cycles}"])
    assert "multiples of 4" in capsys.readouterr().err
