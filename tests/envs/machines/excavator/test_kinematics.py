import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.kinematics import forward, inverse

joint_positions = st.tuples(*[st.floats(lower, upper) for lower, upper in const.JOINT_RANGE_RAD])


@settings(deadline=None)
@given(joint_pos=joint_positions)
def test_forward_agrees_with_mujoco(compiled, joint_pos):
    data = mujoco.MjData(compiled)
    data.qpos[:] = joint_pos
    mujoco.mj_kinematics(compiled, data)
    edge_w, pitch = forward(joint_pos)
    np.testing.assert_allclose(edge_w, data.site("cutting_edge").xpos, atol=1e-9)
    chord_w = data.body("bucket").xmat.reshape(3, 3)[:, 0]
    assert chord_w[2] == pytest.approx(np.sin(pitch), abs=1e-9)


@given(joint_pos=joint_positions, turns=st.integers(-2, 2))
def test_inverse_undoes_forward_with_any_number_of_turns_of_the_pitch(joint_pos, turns):
    edge_w, pitch = forward(joint_pos)
    swing, offset = joint_pos[0], edge_w - const.MACHINE_POS_W
    radius = offset[0] * np.cos(swing) + offset[1] * np.sin(swing)
    found = inverse(radius, edge_w[2], pitch + turns * 2 * np.pi, swing)
    assert found is not None
    np.testing.assert_allclose(found, joint_pos, atol=1e-6)


@given(radius=st.floats(-2, 9), height=st.floats(-6, 9), pitch=st.floats(-7, 7), swing=st.floats(-4, 4))
def test_inverse_returns_a_pose_that_reaches_or_none(radius, height, pitch, swing):
    found = inverse(radius, height, pitch, swing)
    if found is None:
        return
    lower, upper = np.array(const.JOINT_RANGE_RAD).T
    assert ((lower - 1e-6 <= found) & (found <= upper + 1e-6)).all()
    edge_w, found_pitch = forward(found)
    expected = np.array([radius * np.cos(swing), radius * np.sin(swing), height]) + const.MACHINE_POS_W
    np.testing.assert_allclose(edge_w, expected, atol=1e-6)
    assert np.cos(found_pitch - pitch) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("radius", "height", "swing"),
    [(7.5, 0.0, 0.0), (3.0, -5.0, 0.0), (3.0, 8.0, 0.0), (-3.0, 1.0, 0.0), (4.5, 1.0, 3.5)],
    ids=["far", "deep", "high", "behind", "turned too far"],
)
def test_unreachable_points_have_no_pose(radius, height, swing):
    assert inverse(4.5, 1.0, -1.5, 0.0) is not None
    assert inverse(radius, height, -1.5, swing) is None
