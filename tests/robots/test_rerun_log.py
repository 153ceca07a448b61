"""What Rerun gets from a simulated robot, read back from a file, with LeRobot's own logging beside it."""

import numpy as np
import pytest
from lerobot.utils.rerun_visualization import log_rerun_data

from lerobot_excav.envs.tasks.relief import Relief
from lerobot_excav.robots import rerun_log
from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.excavator_sim.excavator_sim import ExcavatorSim
from lerobot_excav.robots.fr5_sim.config_fr5_sim import FR5SimConfig
from lerobot_excav.robots.fr5_sim.fr5_sim import FR5Sim

rerun = pytest.importorskip("rerun", reason="the extra viz")
load_recording = pytest.importorskip("rerun.recording").load_recording


def connected(kind, config, tmp_path, **settings):
    robot = kind(config(id="test", calibration_dir=tmp_path, session_log=tmp_path / "log.jsonl", **settings))
    robot.connect()
    return robot


@pytest.fixture
def excavator(tmp_path):
    robot = connected(ExcavatorSim, ExcavatorSimConfig, tmp_path, fidelity="fast")
    yield robot
    robot.disconnect()


@pytest.fixture
def arm(tmp_path):
    robot = connected(FR5Sim, FR5SimConfig, tmp_path)
    yield robot
    robot.disconnect()


def recorded(robot, path, frames=2):
    """Drive a robot as LeRobot's loops do, into a file; return what the file holds, by path."""
    log_rerun_data.blueprint = None
    action = dict(zip(robot.task_spec.action_names, map(float, robot.env.holding_action()), strict=True))
    with rerun.RecordingStream("test") as recording:  # LeRobot's own would stay open for all tests that follow
        recording.save(path)
        for _ in range(frames):
            observation = robot.get_observation()
            robot.send_action(action)
            log_rerun_data(observation=observation, action=action)
        recording.flush()
        recording.disconnect()
    return {column.entity_path for column in load_recording(path).schema().component_columns()}


@pytest.mark.parametrize("name", ["excavator", "arm"])
def test_target_and_task_state_are_shown_beside_what_lerobot_shows(request, tmp_path, name):
    robot = request.getfixturevalue(name)
    paths = recorded(robot, tmp_path / "out.rrd")
    assert "/excav/main_with_target" in paths
    assert {f"/excav/task_state/{state}" for state in robot.task_spec.task_state_names} <= paths
    assert {f"/observation.{camera}" for camera in robot.cameras} <= paths
    assert ("/excav/ground" in paths) == (name == "excavator")


def test_the_ground_is_logged_as_the_soil_lies(excavator, monkeypatch):
    logged = {}
    monkeypatch.setattr(rerun, "log", lambda path, value, **_: logged.update({path: value}))
    monkeypatch.setattr(rerun_log, "open_recording", lambda: rerun)
    excavator.get_observation()
    points = np.asarray(logged["excav/ground"].vertex_positions.as_arrow_array().to_pylist())
    soil = excavator.env.worksite.soil
    assert len(points) == soil.heights_m.size
    np.testing.assert_allclose(points[:, 2], soil.height_at(points[:, :2]), atol=1e-5)


def test_without_a_recording_nothing_is_drawn(excavator, monkeypatch):
    assert rerun.get_data_recording() is None
    monkeypatch.setattr(rerun, "log", lambda *_, **__: pytest.fail("logged"))
    excavator.get_observation()


def test_a_relief_has_triangles_that_face_up_and_cover_it():
    x, y = np.array([0.0, 0.5, 1.0]), np.array([-1.0, 1.0])
    height = np.array([[0.0, 0.2], [0.1, 0.3], [0.4, 0.0]])
    relief = Relief(x_w=x, y_w=y, height_m=height, rgb=np.zeros((3, 2, 3), np.uint8))
    corners = relief.vertices_w[relief.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normals[:, 2] > 0).all()
    assert 0.5 * normals[:, 2].sum() == pytest.approx(2.0)  # seen from above: 1 m times 2 m
