"""The soil can be chosen wherever one digs, and the choice changes what is dug."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from numpy.typing import NDArray

from lerobot_excav.envs.configs.excavator import ExcavatorEnvConfig
from lerobot_excav.envs.soil import PRESETS
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.operator import ScriptedOperator
from lerobot_excav.envs.tasks.settings import SOILS
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.excavator_sim.excavator_sim import ExcavatorSim
from lerobot_excav.scripts.main import main

PLAYED = ("--scenes=1", "--targets=1", "--episode-length=2", "--workers=0")


def the_environment(soil: str, folder: Path) -> NDArray[Any]:
    config = ExcavatorEnvConfig(soil=soil, episode_length=1, metrics_path=folder / f"{soil}.jsonl")
    vector = config.create_envs(1)["excavator"][0]
    observation, _ = vector.reset(seed=[3])
    assert vector.envs[0].unwrapped.worksite.soil.parameters == PRESETS[soil]
    vector.step(np.zeros((1, 4), np.float32))
    vector.close()
    assert json.loads((folder / f"{soil}.jsonl").read_text())["soil"] == soil
    return np.asarray(observation["pixels"]["main"])


def the_robot(soil: str, folder: Path) -> NDArray[Any]:
    config = ExcavatorSimConfig(soil=soil, calibration_dir=folder, session_log=folder / "session.jsonl")
    robot = ExcavatorSim(config)
    robot.connect()
    assert robot.env.worksite.soil.parameters == PRESETS[soil]
    picture = robot.get_observation()["main"]
    robot.disconnect()
    return np.asarray(picture)


def the_demonstrations(soil: str, folder: Path) -> NDArray[Any]:
    out = folder / soil
    assert main(["demos", *PLAYED, f"--soil={soil}", f"--out={out}", "--keep-failures"]) == 0
    (table,) = [pq.read_table(path) for path in out.glob("data/*/*.parquet")]
    assert set(table["excav.soil"].to_pylist()) == {soil}
    return np.frombuffer(table["observation.images.main"][0]["bytes"].as_py(), np.uint8)


def the_operators_benchmark(soil: str, folder: Path) -> NDArray[Any]:
    path = folder / f"{soil}.jsonl"
    assert main(["bench", "operator", *PLAYED, f"--soil={soil}", f"--metrics={path}"]) == 0
    assert json.loads(path.read_text())["soil"] == soil
    return np.frombuffer(soil.encode(), np.uint8)


@pytest.mark.parametrize(
    "start",
    [the_environment, the_robot, the_demonstrations, the_operators_benchmark],
    ids=lambda f: f.__name__,
)
def test_every_command_digs_the_soil_it_is_given(start: Callable[[str, Path], NDArray[Any]], tmp_path: Path) -> None:
    seen = {soil: start(soil, tmp_path).tobytes() for soil in SOILS}
    assert len(set(seen.values())) == len(SOILS)


def test_soils_fill_the_bucket_differently() -> None:
    taken_kg = set()
    for soil in SOILS:
        env = ExcavatorEnv(soil=soil, obs_type="agent_pos")
        env.reset(options={"scene_id": 2, "target_id": 2})
        operator = ScriptedOperator(rng=np.random.default_rng(0))
        operator.reset(env)
        for _ in range(60):
            env.step(operator.act(env))
        taken_kg.add(env.worksite.soil.payload_mass_kg)
    assert min(taken_kg) > 50.0
    assert len(taken_kg) == len(SOILS)
