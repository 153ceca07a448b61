"""When a load counts as spilled on its way to the box."""

from types import SimpleNamespace

import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator.bucket import bucket_geometry
from lerobot_excav.envs.machines.excavator.layout import TARGET_BOX
from lerobot_excav.envs.soil import Tool
from lerobot_excav.envs.tasks.scoop.carry import CarryWatch, bucket_clearance_m
from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv
from lerobot_excav.envs.tasks.scoop.operator import DigOperator

PILE, WAY, BOX = np.zeros(2), np.array([-2.0, 3.0]), TARGET_BOX.center_w[:2]
IN_THE_SOIL, LOW, HIGH = 0.2, 0.7, 1.5  # heights of the tool's origin, 0.57 m above the bucket's lowest point [m]


def spills(*steps):
    """Let a bucket be at places (xy, height) with payloads, step by step, and return how often soil was spilled."""
    site = SimpleNamespace(soil=SimpleNamespace(height_at=lambda xy_w: np.zeros(len(xy_w))))
    watch, events = CarryWatch(site), 0
    for xy_w, height_m, payload_kg in steps:
        position_w = np.array([*xy_w, height_m])
        # Upside down, the bucket's belly is its lowest part.
        rotation_w = np.diag([1.0, -1.0, -1.0])
        still = {"linear_velocity_w": np.zeros(3), "angular_velocity_w": np.zeros(3)}
        tool = Tool(geometry=bucket_geometry(), position_w=position_w, rotation_w=rotation_w, **still)
        site.machine = SimpleNamespace(cutting_edge_pos_w=position_w, tool=lambda tool=tool: tool)
        events += watch.update(payload_kg)
    return events


@pytest.mark.parametrize(
    ("steps", "events"),
    [
        pytest.param([(PILE, HIGH, 400.0), (WAY, HIGH, 350.0)], 1, id="lost on the way"),
        pytest.param([(PILE, HIGH, 400.0), (WAY, HIGH, 390.0), (WAY, HIGH, 350.0)], 1, id="bit by bit"),
        pytest.param([(PILE, HIGH, 400.0), (WAY, HIGH, 300.0), (WAY, HIGH, 100.0)], 1, id="one way, one spill"),
        pytest.param([(PILE, HIGH, 400.0), (WAY, HIGH, 370.0)], 0, id="a trickle from a full bucket"),
        pytest.param([(PILE, HIGH, 60.0), (WAY, HIGH, 45.0)], 0, id="a trickle from a small load"),
        pytest.param([(PILE, HIGH, 60.0), (WAY, HIGH, 35.0)], 1, id="half of a small load"),
        pytest.param([(PILE, HIGH, 40.0), (WAY, HIGH, 0.0)], 0, id="nearly empty"),
        pytest.param([(PILE, LOW, 400.0), (PILE, LOW, 300.0)], 0, id="shed over the pile"),
        pytest.param([(PILE, HIGH, 400.0), (BOX, HIGH, 400.0), (BOX, HIGH, 0.0)], 0, id="dumped"),
        pytest.param(
            [(PILE, HIGH, 400.0), (PILE, IN_THE_SOIL, 400.0), (PILE, IN_THE_SOIL, 200.0)], 0, id="dug in again"
        ),
        pytest.param(2 * [(PILE, HIGH, 400.0), (WAY, HIGH, 300.0), (BOX, HIGH, 0.0)], 2, id="two ways"),
    ],
)
def test_a_spill_is_a_loss_of_a_lifted_load_before_the_box(steps, events):
    assert spills(*steps) == events


def played(*, opens):
    """Play an operator's cycle, whose bucket opens on the way if asked; return the task state by name."""
    env = ExcavatorEnv(obs_type="agent_pos", render_mode=None, scene_set="train", fidelity="fast")
    env.reset(options={"scene_id": 3, "target_id": 1})
    operator = DigOperator(rng=np.random.default_rng(3))
    operator.reset(env)
    is_over, open_frames = False, 30 if opens else 0
    while not is_over:
        action = operator.act(env)
        if open_frames and operator.phase == "carry":
            action, open_frames = np.array([0.0, 0.0, 0.0, 1.0], np.float32), open_frames - 1
        _, _, terminated, truncated, _ = env.step(action)
        is_over = terminated or truncated
    return env.cycle.state


@pytest.mark.parametrize("opens", [False, True])
def test_a_cycle_that_opens_the_bucket_on_the_way_spills_and_a_good_one_does_not(opens):
    assert (played(opens=opens).spill_before_target_events > 0) == opens


def test_clearance_is_that_of_the_lowest_point():
    site = SimpleNamespace(soil=SimpleNamespace(height_at=lambda xy_w: np.full(len(xy_w), 0.25)))
    still = {"linear_velocity_w": np.zeros(3), "angular_velocity_w": np.zeros(3)}
    upright = Tool(geometry=bucket_geometry(), position_w=np.array([0.0, 0.0, 2.0]), rotation_w=np.eye(3), **still)
    assert bucket_clearance_m(site, upright) == pytest.approx(1.75)
