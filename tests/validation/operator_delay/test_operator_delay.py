import json

import numpy as np
import pytest

from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from lerobot_excav.errors import ConfigurationError
from validation.operator_delay import __main__ as command
from validation.operator_delay.drive import Condition, drive
from validation.operator_delay.page import write_page

SCOOP_1 = {"scene_set": "val", "scene_id": 1, "target_id": 1, "seed": 0}


def scoop(rate_hz, delay_ms, scene_id, *, is_success=True, kg=400.0):
    return {
        **{"rate_hz": rate_hz, "delay_ms": delay_ms, "scene_id": scene_id, "is_success": is_success},
        **{"target_success": True, "retained_mass_kg": kg, "hard_target_contacts": 0, "duration_s": 14.0},
        "simulation_version": SCOOP.simulation_version,
    }


@pytest.mark.slow
def test_without_a_delay_at_the_frame_rate_of_the_environment_the_scoop_is_the_environments():
    env = SCOOP.make_env(scene_set="val", obs_type="agent_pos", render_mode=None)
    env.reset(options={"scene_id": 1, "target_id": 1})
    operator = SCOOP.make_operator(np.random.default_rng((0, 1, 1)))
    operator.reset(env)
    done = False
    while not done:
        *_, terminated, truncated, info = env.step(operator.act(env))
        done = terminated or truncated
    found = drive(Condition(rate_hz=env.fps, delay_ms=0), **SCOOP_1)
    assert found["retained_mass_kg"] == env.cycle.state.deposited_mass_kg
    assert found["is_success"] == info["is_success"]


@pytest.mark.parametrize(
    ("values", "message"),
    [((20, 0), "rate_hz=20"), ((0, 0), "rate_hz=0"), ((10, 30), "delay_ms=30"), ((10, -20), "delay_ms=-20")],
)
def test_rates_and_delays_that_are_no_whole_ticks_are_refused(values, message):
    with pytest.raises(ConfigurationError, match=message):
        Condition(rate_hz=values[0], delay_ms=values[1])


def test_the_page_has_a_row_and_an_interval_for_every_condition(tmp_path):
    scoops = [
        scoop(rate, delay, n, is_success=n > 0, kg=100.0 * n)
        for rate in (10, 50)
        for delay in (0, 60)
        for n in range(4)
    ]
    write_page(scoops, tmp_path / "page.md")
    text = (tmp_path / "page.md").read_text()
    for rate in (10, 50):
        for delay in (0, 60):
            assert f"| {rate} | {delay} | 75 [30, 95] | 100 [51, 100] | 150 [" in text
    assert (tmp_path / "images" / "rate_and_delay.png").stat().st_size > 0


def test_finished_scoops_are_not_played_again_and_those_of_another_simulation_do_not_count(tmp_path, monkeypatch):
    file = tmp_path / "scoops.jsonl"
    old = {**scoop(10, 0, 1), "simulation_version": SCOOP.simulation_version - 1}
    file.write_text("".join(json.dumps(line) + "\n" for line in (scoop(10, 0, 0), old)))
    played = []

    def play(condition, *, scene_id, **_):
        played.append((condition.rate_hz, condition.delay_ms, scene_id))
        return scoop(condition.rate_hz, condition.delay_ms, scene_id)

    monkeypatch.setattr(command, "drive", play)
    arguments = [
        "--scoops=2",
        "--rates=10",
        "--delays=0,20",
        "--workers=0",
        f"--file={file}",
        f"--page={tmp_path / 'p.md'}",
    ]
    assert command.main(arguments) == 0
    assert sorted(played) == [(10, 0, 1), (10, 20, 0), (10, 20, 1)]
    assert command.main(arguments) == 0
    assert len(played) == 3


def test_a_line_that_an_interruption_cut_short_is_dropped(tmp_path):
    whole, torn = json.dumps(scoop(10, 0, 0)) + "\n", json.dumps(scoop(10, 0, 1))[:50]
    path = tmp_path / "scoops.jsonl"
    path.write_text(whole + torn)
    assert [found["scene_id"] for found in command.read_finished(path)] == [0]
    assert path.read_text() == whole
