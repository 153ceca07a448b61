import pytest

from lerobot_excav.robots.excavator_sim.config_excavator_sim import ExcavatorSimConfig
from lerobot_excav.robots.excavator_sim.excavator_sim import ExcavatorSim
from lerobot_excav.teleoperators.excavator_joystick.config_excavator_joystick import ExcavatorJoystickConfig
from lerobot_excav.teleoperators.excavator_joystick.excavator_joystick import ExcavatorJoystick
from lerobot_excav.teleoperators.excavator_operator.config_excavator_operator import ExcavatorOperatorConfig
from lerobot_excav.teleoperators.excavator_operator.excavator_operator import ExcavatorOperator


@pytest.fixture(params=["joystick", "operator"])
def teleoperator(request, tmp_path):
    if request.param == "joystick":
        return ExcavatorJoystick(ExcavatorJoystickConfig(calibration_dir=tmp_path))
    return ExcavatorOperator(ExcavatorOperatorConfig(calibration_dir=tmp_path))


def test_its_actions_are_those_of_the_robot(teleoperator, tmp_path):
    robot = ExcavatorSim(ExcavatorSimConfig(calibration_dir=tmp_path, session_log=tmp_path / "s.jsonl"))
    assert teleoperator.action_features == robot.action_features


def test_it_needs_neither_calibration_nor_feedback(teleoperator):
    teleoperator.calibrate()
    teleoperator.configure()
    teleoperator.send_feedback({})
    assert teleoperator.is_calibrated
    assert teleoperator.feedback_features == {}
    assert not teleoperator.is_connected
