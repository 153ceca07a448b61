"""Where machines act, told by what they changed."""

from types import SimpleNamespace

import numpy as np
import pytest

from lerobot_excav.envs.tasks.grasp.spec import GRASP
from lerobot_excav.envs.tasks.registry import TASKS
from lerobot_excav.envs.tasks.scoop.place_probe import MARGIN_M, DugPlace
from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from lerobot_excav.envs.tasks.scoop.targets import Target

CELL_M = 0.1


def site():
    """A flat site with a patch of 0.8 m at (1, 0), and nothing but what a probe looks at."""
    x_w, y_w = np.arange(-2.0, 3.0, CELL_M), np.arange(-2.0, 2.0, CELL_M)
    soil = SimpleNamespace(heights_m=np.full((len(x_w), len(y_w)), 0.5), x_w=x_w, y_w=y_w)
    target = Target(center_w=np.array([1.0, 0.0, 0.5]), yaw_rad=0.0, size_m=0.8)
    machine = SimpleNamespace(cutting_edge_pos_w=np.array([1.1, 0.1, 0.4]))
    return SimpleNamespace(
        worksite=SimpleNamespace(soil=soil, machine=machine),
        target=target,
        cycle=SimpleNamespace(onset_w=None),
    )


def dig(env, x_m, y_m, depth_m):
    """Take soil from one cell."""
    soil = env.worksite.soil
    soil.heights_m[np.argmin(abs(soil.x_w - x_m)), np.argmin(abs(soil.y_w - y_m))] -= depth_m


def test_soil_is_shared_out_between_the_patch_with_its_margin_and_the_rest():
    env = site()
    probe = DugPlace(env)
    dig(env, 1.0, 0.0, 0.1)
    dig(env, 1.0 + 0.4 + 0.5 * MARGIN_M, 0.0, 0.1)  # beyond the edge, within the margin
    dig(env, 1.0 + 0.4 + 1.5 * MARGIN_M, 0.0, 0.2)  # beyond the margin
    dig(env, -1.0, 0.0, -0.3)  # a heap is no loss
    assert probe.acted() is None  # nothing has been loaded yet
    env.cycle.onset_w = np.array([1.2, 0.3, 0.4])
    probe.update()
    env.cycle.onset_w = np.array([9.0, 9.0, 9.0])  # a later onset, as after another command, is not the first
    probe.update()
    acted = probe.acted()
    assert acted.share == pytest.approx(0.5)
    assert acted.began_w.tolist() == [1.2, 0.3]
    assert acted.acted_w == pytest.approx([(1.0 + 1.5 + 2 * 1.7) / 4, 0.0], abs=1e-9)
    assert probe.tool_pos_w.tolist() == [1.1, 0.1, 0.4]
    assert probe.commanded_w.tolist() == [1.0, 0.0]


def played(spec, target_id):
    """Let the scripted operator play a scene; return its probe at the end."""
    env = spec.make_env(obs_type="agent_pos", render_mode=None, scene_set="val")
    env.reset(options={"scene_id": 3, "target_id": target_id})
    probe, operator = spec.make_place_probe(env), spec.make_operator(np.random.default_rng(0))
    operator.reset(env)
    assert not probe.has_begun
    is_over = False
    while not is_over:
        _, _, terminated, truncated, _ = env.step(operator.act(env))
        probe.update()
        is_over = terminated or truncated
    return probe


@pytest.mark.slow
@pytest.mark.parametrize("spec", [SCOOP, GRASP], ids=lambda spec: spec.id)
@pytest.mark.parametrize("target_id", [0, 2])
def test_an_operator_acts_where_it_is_told_to(spec, target_id):
    probe = played(spec, target_id)
    acted = probe.acted()
    assert probe.has_begun
    assert np.linalg.norm(acted.began_w - probe.commanded_w) < 0.5 * (0.8 if spec is SCOOP else 0.1)
    assert acted.share > (0.3 if spec is SCOOP else 0.99)
    # A cut ends nearer to the machine than it begins.
    assert np.linalg.norm(acted.acted_w - probe.commanded_w) < (1.5 if spec is SCOOP else 1e-6)


@pytest.mark.parametrize("task_id", list(TASKS))
def test_a_task_that_is_shown_with_each_of_its_targets_can_be_audited(task_id):
    spec = TASKS[task_id]
    assert (spec.place_probe_entry is not None) == (spec.default_target is None)
