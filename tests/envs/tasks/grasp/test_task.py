import numpy as np
import pytest

from lerobot_excav.envs.machines.fr5 import layout
from lerobot_excav.envs.tasks.grasp.scene import draw_scene
from lerobot_excav.envs.tasks.grasp.spec import TASK_STATE_NAMES
from lerobot_excav.envs.tasks.grasp.task import GraspTask

SCENE = draw_scene("train", 2)
IN_TRAY = np.array([*layout.TRAY_POS_W, layout.TRAY_HEIGHT_M + layout.BLOCK_REST_M])
LEFT, RIGHT = (-0.03, 0, 0), (0.03, 0, 0)


def put(workcell, block, position_w, speed=0.0):
    joint = workcell.data.joint(f"block{block}")
    joint.qpos[:], joint.qvel[:] = [*position_w, 1, 0, 0, 0], [speed, 0, 0, 0, 0, 0]


def hold(workcell, ticks=5):
    for _ in range(ticks):
        workcell.tick(np.append(SCENE.joint_pos, 1.0))


@pytest.fixture
def task(workcell):
    workcell.reset(SCENE)
    return GraspTask(workcell, 1)


@pytest.mark.parametrize(
    ("blocks", "reward", "in_tray"),
    [
        pytest.param({}, 0.0, 0, id="nothing done"),
        pytest.param({1: (0, 0, 0)}, 4.0, 1, id="the commanded block alone"),
        pytest.param({2: (0, 0, 0)}, 0.0, 1, id="another block"),
        pytest.param({1: LEFT, 3: RIGHT}, 4.0, 2, id="a second block"),
        pytest.param({1: (0.077, 0, layout.TRAY_RIM_M)}, 0.0, 0, id="on the rim"),
    ],
)
def test_only_the_commanded_block_alone_in_the_tray_is_success(task, workcell, blocks, reward, in_tray):
    for block, offset in blocks.items():
        put(workcell, block, IN_TRAY + offset)
    hold(workcell)
    assert task.update() == reward
    metrics = task.metrics()
    assert metrics["blocks_in_tray"] == in_tray
    assert metrics["target_in_tray"] == (reward == 4.0)
    assert metrics["first_grasped_block"] == layout.NO_BLOCK
    assert task.is_success == (reward == 4.0 and in_tray == 1)


@pytest.mark.parametrize(
    ("offset", "speed"),
    [((-layout.TRAY_RADIUS_M - 0.01, 0, 0), 0.0), ((0, 0, layout.BLOCK_SIZE_M), 0.0), ((0, 0, 0.008), 0.3)],
    ids=["beside", "above", "moving"],
)
def test_a_block_that_does_not_rest_on_the_floor_of_the_tray_is_not_in_it(task, workcell, offset, speed):
    put(workcell, 1, IN_TRAY + offset, speed)
    hold(workcell, 1)
    if not speed:
        workcell.data.joint("block1").qvel[:] = 0
    task.update()
    assert not task.metrics()["target_in_tray"]
    assert not task.is_success


def test_a_block_in_the_tray_that_a_finger_touches_is_not_released(task, workcell, monkeypatch):
    put(workcell, 1, IN_TRAY)
    hold(workcell)
    # By any part of the gripper: pads, rods or hand.
    monkeypatch.setattr(workcell, "arm_touching", lambda: np.arange(layout.BLOCK_COUNT) == 1)
    assert task.update() == 0.0
    assert not task.is_success
    assert not task.metrics()["released"]


def test_another_block_that_still_moves_in_the_tray_spoils_the_success(task, workcell):
    put(workcell, 1, IN_TRAY + LEFT)
    hold(workcell)
    put(workcell, 3, np.add(IN_TRAY, (0.03, 0, 0.05)))
    hold(workcell, 1)
    assert task.update() == 4.0
    assert task.metrics()["blocks_in_tray"] == 1
    assert not task.is_success


def test_stages_of_the_reward_come_in_order_and_end_at_their_greatest(play):
    task, rewards, _ = play(2, 1)
    metrics = task.metrics()
    assert task.is_success
    assert set(rewards) == {0.0, 1.0, 2.0, 3.0, 4.0}
    first = [int(np.argmax(rewards == stage)) for stage in (1.0, 2.0, 3.0, 4.0)]
    assert first == sorted(first)
    assert rewards[-1] == metrics["max_reward"] == 4.0
    assert metrics["episode_return"] == rewards.sum() > 700
    assert metrics["first_grasped_block"] == 1
    assert metrics["target_grasped"]


def lift(task, workcell, monkeypatch, block, pads):
    """Show the task a block 10 cm above the table that some of the pads touch; return the frame's reward."""
    position_w = workcell.block_pos_w
    position_w[block, 2] += 0.1
    touching = np.zeros((2, layout.BLOCK_COUNT), dtype=bool)
    touching[:pads, block] = True
    with monkeypatch.context() as patch:
        patch.setattr(type(workcell), "block_pos_w", position_w)
        patch.setattr(workcell, "fingers_touching", lambda: touching)
        return task.update()


def test_the_first_grasped_block_is_remembered_until_the_command_changes(task, workcell, monkeypatch):
    def first_after(block, pads=2):
        lift(task, workcell, monkeypatch, block, pads)
        return task.metrics()["first_grasped_block"]

    assert [first_after(2), first_after(1), first_after(2)] == [2, 2, 2]
    assert not task.metrics()["target_grasped"]
    task.retarget(3)
    assert first_after(2) == layout.NO_BLOCK  # still held from before
    assert first_after(2, pads=0) == layout.NO_BLOCK
    assert [first_after(3), first_after(3, pads=0), first_after(1)] == [3, 3, 3]
    assert task.metrics()["target_grasped"]


@pytest.mark.parametrize(("pads", "reward"), [(0, 0.0), (1, 0.0), (2, 2.0)])
def test_a_block_is_lifted_by_both_fingers_only(task, workcell, monkeypatch, pads, reward):
    assert lift(task, workcell, monkeypatch, 1, pads) == reward
    assert task.metrics()["first_grasped_block"] == (1 if pads == 2 else layout.NO_BLOCK)


def test_task_state_tells_of_the_commanded_block(task, workcell):
    hold(workcell)
    task.update()
    state = dict(zip(TASK_STATE_NAMES, task.task_state, strict=True))
    distance = np.linalg.norm(workcell.block_pos_w[1] - workcell.grasp_pos_w)
    assert state["gripper_to_target_m"] == pytest.approx(distance, rel=1e-6)
    assert state["target_height_m"] == pytest.approx(0.0, abs=1e-3)
    assert state["first_grasped_block"] == layout.NO_BLOCK


def test_a_new_command_is_what_success_is_judged_by(task, workcell):
    put(workcell, 2, IN_TRAY)
    task.retarget(2)
    hold(workcell)
    assert task.update() == 4.0
    assert task.is_success
    assert task.target_id == 2
