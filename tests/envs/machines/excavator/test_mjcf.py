import mujoco
import numpy as np
import pytest

from lerobot_excav.envs.machines.excavator import constants as const
from lerobot_excav.envs.machines.excavator.bodywork import SURROUNDINGS_BIT, WORKING_BIT
from lerobot_excav.envs.machines.excavator.cameras import CAB, MAIN, OVERVIEW
from lerobot_excav.envs.machines.excavator.mjcf import build_spec
from lerobot_excav.envs.soil import Container
from lerobot_excav.envs.soil.plates import PLATE_THICKNESS_M


@pytest.fixture
def data(model):
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return data


def colliding(model, body):
    geoms = np.flatnonzero(model.geom_bodyid == model.body(body).id)
    return [g for g in geoms if model.geom_contype[g] or model.geom_conaffinity[g]]


@pytest.mark.parametrize("body", ["boom", "arm", "bucket"])
def test_working_end_collides_with_surroundings_only(model, body):
    geoms = colliding(model, body)
    assert geoms
    assert {int(model.geom_contype[g]) for g in geoms} == {WORKING_BIT}
    assert {int(model.geom_conaffinity[g]) for g in geoms} == {SURROUNDINGS_BIT}


@pytest.mark.parametrize(("body", "count"), [("box", 5), ("undercarriage", 3)], ids=["box", "tracks and dozer blade"])
def test_what_stands_still_stops_the_working_end(model, body, count):
    geoms = colliding(model, body)
    assert len(geoms) == count
    assert all(model.geom_contype[g] & SURROUNDINGS_BIT and model.geom_conaffinity[g] & WORKING_BIT for g in geoms)


def test_ground_is_not_what_is_drawn_as_ground(model):
    assert model.geom("ground").contype[0] == SURROUNDINGS_BIT
    assert model.geom("ground_picture").contype[0] == model.geom("ground_picture").conaffinity[0] == 0


@pytest.mark.parametrize("swing", [0.0, 0.6, 1.39])
def test_raised_machine_touches_nothing(model, data, swing):
    data.qpos[:] = [swing, 0.8, -1.5, -1.5]
    mujoco.mj_forward(model, data)
    assert data.ncon == 0


def test_inner_walls_of_the_box_are_where_the_container_says():
    container = Container(center_w=(-3.0, 5.0, 0.0), half_extent_m=(1.2, 0.9), wall_height_m=0.8, yaw_rad=0.3)
    model = build_spec(container).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    walls = (("front", (1, 0), 1.2), ("back", (-1, 0), 1.2), ("left", (0, 1), 0.9), ("right", (0, -1), 0.9))
    for name, axis, half in walls:
        wall = model.geom(f"box_wall_{name}").id
        outward_w = np.array([*(np.array(axis, float) @ container.axes_w), 0.0])
        from_center = outward_w @ (data.geom_xpos[wall] - container.center_w)
        assert from_center - const.BOX_WALL_THICKNESS_M / 2 == pytest.approx(half)
        assert data.geom_xpos[wall, 2] + model.geom_size[wall, 2] == pytest.approx(0.8)


def test_bucket_plates_lie_outside_the_inner_profile(model):
    body = model.body("bucket").id
    for i in range(len(const.BUCKET_PROFILE_T) - 1):
        plate = model.geom(f"bucket_plate_{i}")
        assert plate.bodyid[0] == body
        start, end = np.array(const.BUCKET_PROFILE_T[i : i + 2])
        middle = 0.5 * (start + end)
        offset = plate.pos[[0, 2]] - middle
        assert np.linalg.norm(offset) == pytest.approx(PLATE_THICKNESS_M / 2)
        assert abs(offset @ (end - start)) < 1e-9
        assert offset @ (middle - np.array([0.6, 0.2])) > 0  # away from a point inside


@pytest.mark.parametrize(("name", "pose"), [("main", MAIN), ("overview", OVERVIEW), ("cab", CAB)])
def test_cameras_stand_and_look_as_their_poses_say(model, data, name, pose):
    camera = model.camera(name)
    origin = data.body("house").xpos if name == "cab" else np.zeros(3)
    np.testing.assert_allclose(data.cam_xpos[camera.id] - origin, pose.position, atol=1e-9)
    to_target = np.subtract(pose.target, pose.position)
    forward_w = -data.cam_xmat[camera.id].reshape(3, 3)[:, 2]
    np.testing.assert_allclose(forward_w, to_target / np.linalg.norm(to_target), atol=1e-9)
    assert camera.fovy[0] == pose.fovy_deg


def test_a_diverged_state_is_not_silently_reset(model):
    assert model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET
