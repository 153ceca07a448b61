import numpy as np
import pytest

from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.operator import DigOperator
from lerobot_excav.envs.tasks.scoop.spec import ENVIRONMENT_STATE_NAMES, HEIGHT_CELLS

AREA_M2, SAND_T_M3 = 36.0, 1.474
FIRST_HEIGHT = ENVIRONMENT_STATE_NAMES.index("height_m.0.0")


def named(env):
    return dict(zip(ENVIRONMENT_STATE_NAMES, env.environment_state.tolist(), strict=True))


def heights_m(env):
    return env.environment_state[FIRST_HEIGHT:].reshape(HEIGHT_CELLS)


@pytest.mark.parametrize("fidelity", ["fast", "standard", "fine"])
def test_the_map_holds_the_volume_of_the_pile(fidelity):
    env = ExcavatorEnv(obs_type="state", render_mode=None, fidelity=fidelity)
    env.reset(seed=2)
    soil = env.worksite.soil
    assert AREA_M2 * heights_m(env).mean() == pytest.approx(AREA_M2 * soil.heights_m.mean(), rel=1e-6)
    assert soil.heights_m.max() > heights_m(env).max() > 0.5


def test_the_highest_cell_lies_where_the_pile_is_highest():
    env = ExcavatorEnv(obs_type="state", render_mode=None, fidelity="fast")
    env.reset(seed=2)
    coarse = np.argwhere(heights_m(env) == heights_m(env).max())[0]
    soil = env.worksite.soil
    at_w = -3.0 + 0.5 * (coarse + 0.5)
    assert soil.height_at(at_w[None])[0] > 0.8 * soil.heights_m.max()


def test_a_scoop_moves_soil_from_the_map_over_the_bucket_into_the_box():
    env = ExcavatorEnv(obs_type="state", render_mode=None, fidelity="fast")
    observation, _ = env.reset(seed=2)
    operator = DigOperator(rng=np.random.default_rng(0))
    operator.reset(env)
    before, mean_before_m, most_t, is_over = named(env), heights_m(env).mean(), 0.0, False
    assert before["target.x_w"] == pytest.approx(env.target.center_w[0], abs=1e-6)
    while not is_over:
        observation, _, terminated, truncated, _ = env.step(operator.act(env))
        is_over = terminated or truncated
        most_t = max(most_t, named(env)["bucket_mass_t"])
    after = named(env)
    assert observation["environment_state"].tolist() == list(after.values())
    assert before["box_mass_t"] == before["bucket_mass_t"] == 0.0
    assert most_t > 0.25
    assert after["box_mass_t"] == pytest.approx(1e-3 * env.worksite.soil.ledger_kg()["box"], rel=1e-6)
    moved_t = 1e-3 * sum(mass for place, mass in env.worksite.soil.ledger_kg().items() if place != "grid")
    assert SAND_T_M3 * AREA_M2 * (mean_before_m - heights_m(env).mean()) == pytest.approx(moved_t, rel=0.01)
