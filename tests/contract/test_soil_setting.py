"""The soil can be chosen wherever one digs, and the choice changes what is dug."""

import json

import numpy as np
import pyarrow.parquet as pq
import pytest

from lerobot_excav.envs.configs.excavator import ExcavatorEnvConfig
from lerobot_excav.envs.soil import PRESETS
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.operator import DigOperator
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.excavator_sim.excavator_sim import ExcavatorSim
from lerobot_excav.scripts.main import main

PLAYED = ("--env.type=excavator", "--scenes=1", "--targets=1", "--env.episode_length=2", "--workers=0")


def the_environment(soil, folder):
    config = ExcavatorEnvConfig(soil=soil, episode_length=1, metrics_path=folder / f"{soil}.jsonl")
    vector = config.create_envs(1)["excavator"][0]
    observation, _ = vector.reset(seed=[3])
    assert vector.envs[0].unwrapped.world.soil.parameters == PRESETS[soil]
    vector.step(np.zeros((1, 4), np.float32))
    vector.close()
    assert json.loads((folder / f"{soil}.jsonl").read_text())["soil"] == soil
    return observation["pixels"]["main"].tobytes()


def the_robot(soil, folder):
    config = ExcavatorSimConfig(soil=soil, calibration_dir=folder, session_log=folder / "session.jsonl")
    with ExcavatorSim(config) as robot:
        assert robot.env.world.soil.parameters == PRESETS[soil]
        return robot.get_observation()["main"].tobytes()


def the_demonstrations(soil, folder):
    out = folder / soil
    assert main(["demos", *PLAYED, f"--env.soil={soil}", f"--out={out}", "--keep_failures"]) == 0
    (table,) = [pq.read_table(path) for path in out.glob("data/*/*.parquet")]
    assert set(table["excav.soil"].to_pylist()) == {soil}
    return table["observation.images.main"][0]["bytes"].as_py()


def the_operator(soil, folder):
    path = folder / f"{soil}.jsonl"
    assert main(["operator", *PLAYED, f"--env.soil={soil}", f"--metrics={path}"]) == 0
    assert json.loads(path.read_text())["soil"] == soil
    return soil


@pytest.mark.slow
@pytest.mark.parametrize("start", [the_environment, the_robot, the_demonstrations, the_operator])
def test_every_command_digs_the_soil_it_is_given(start, tmp_path):
    seen = {soil: start(soil, tmp_path) for soil in PRESETS}
    assert len(set(seen.values())) == len(PRESETS)


def a_start_of(setting, value, folder):
    """Return the first picture of an environment, the first of a recording, and the density of what is dug."""
    config = ExcavatorEnvConfig(**{setting: value}, episode_length=1, metrics_path=folder / f"{value}.jsonl")
    vector = config.create_envs(1)["excavator"][0]
    observation, _ = vector.reset(seed=[0])
    vector.step(np.zeros((1, 4), np.float32))
    vector.close()
    assert json.loads((folder / f"{value}.jsonl").read_text())[setting] == value
    density_kg_m3 = vector.envs[0].unwrapped.world.soil.density_kg_m3
    out = folder / value
    assert main(["demos", *PLAYED, f"--env.{setting}={value}", f"--out={out}", "--keep_failures"]) == 0
    (table,) = [pq.read_table(path) for path in out.glob("data/*/*.parquet")]
    assert set(table[f"excav.{setting}"].to_pylist()) == {value}
    assert main(["qc", str(out), "--replays=1"]) == 0  # the same pile is drawn from the columns
    recorded = table["observation.images.main"][0]["bytes"].as_py()
    return observation["pixels"]["main"].tobytes(), recorded, density_kg_m3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("setting", "values"), [("pile", ("heaps", "two_heaps", "ridge")), ("density", ("light", "usual", "heavy"))]
)
def test_pile_and_density_are_chosen_by_name_kept_in_data_and_told_in_metrics(setting, values, tmp_path):
    seen = [a_start_of(setting, value, tmp_path) for value in values]
    assert len(set(seen)) == len(values)
    pictures = {(shown, recorded) for shown, recorded, _ in seen}
    assert len(pictures) == (1 if setting == "density" else len(values))  # of another density are the same piles


def test_the_density_reaches_the_ground():
    soil = ExcavatorEnv(density="heavy", render_mode=None).world.soil
    assert soil.density_kg_m3 == pytest.approx(1.2 * PRESETS["sand"].density_kg_m3)


@pytest.mark.slow
def test_soils_fill_the_bucket_differently():
    taken_kg = set()
    for soil in PRESETS:
        env = ExcavatorEnv(soil=soil, obs_type="agent_pos")
        env.reset(options={"scene_id": 2, "target_id": 2})
        operator = DigOperator(rng=np.random.default_rng(0))
        operator.reset(env)
        for _ in range(60):
            env.step(operator.act(env))
        taken_kg.add(env.world.soil.payload_mass_kg)
    assert min(taken_kg) > 50.0
    assert len(taken_kg) == len(PRESETS)
