from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.envs.machines.excavator.bucket import bucket_geometry
from lerobot_excav.envs.machines.excavator.layout import DIG_AREA_EXTENT_M, TARGET_BOX
from lerobot_excav.envs.soil import Tool
from lerobot_excav.envs.tasks.scoop.targets import Target
from lerobot_excav.envs.tasks.scoop.task_state import TaskMeter, depth_below_dig_plane_m, distance_to_box_m

TARGET = Target(center_w=np.array([0.0, 0.0, 0.5]), yaw_rad=0.0)


def tool_at(position_w):
    still = {"rotation_w": np.eye(3), "linear_velocity_w": np.zeros(3), "angular_velocity_w": np.zeros(3)}
    return Tool(geometry=bucket_geometry(), position_w=position_w, **still)


def meter_and_site(edge_pos_w=(0.0, 0.0, 2.0), box_mass_kg=0.0):
    """Return a meter on a worksite whose bucket, box and contact sensor read what a test says."""
    tool = tool_at(np.array([0.0, 0.0, 3.0]))
    edge_w = np.array(edge_pos_w)
    machine = SimpleNamespace(cutting_edge_pos_w=edge_w, box_contact_force_n=0.0, tool=lambda: tool)
    soil = SimpleNamespace(payload_mass_kg=0.0, box_mass_kg=box_mass_kg, height_at=lambda xy_w: np.zeros(len(xy_w)))
    site = SimpleNamespace(machine=machine, soil=soil)
    return TaskMeter(site, TARGET), site


def test_excavated_mass_counts_soil_that_enters_again_twice():
    meter, site = meter_and_site()
    for payload_kg in (30.0, 10.0, 30.0):
        site.soil.payload_mass_kg = payload_kg
        meter.update()
    assert meter.state.excavated_mass_kg == 50.0


def test_what_the_cycle_before_has_left_is_not_counted_again():
    _, site = meter_and_site()
    site.soil.payload_mass_kg, site.machine.box_contact_force_n = 80.0, 6000.0
    meter = TaskMeter(site, TARGET)
    assert meter.state.bucket_mass_kg == 80.0
    meter.update()
    assert (meter.state.excavated_mass_kg, meter.state.hard_target_contacts) == (0.0, 0)


def test_deposited_mass_starts_at_the_box_as_it_was():
    meter, site = meter_and_site(box_mass_kg=300.0)
    site.soil.box_mass_kg = 340.0
    assert meter.update().deposited_mass_kg == 40.0


def test_distance_to_the_target_is_taken_from_the_cutting_edge():
    assert meter_and_site(edge_pos_w=(3.0, 4.0, 0.5))[0].state.distance_to_target_m == pytest.approx(5.0)


def test_one_touch_counts_once_however_long_and_only_when_hard():
    meter, site = meter_and_site()
    for force_n in (0.0, 4000.0, 6000.0, 9000.0, 100.0, 7000.0, 0.0, 8000.0):
        site.machine.box_contact_force_n = force_n
        meter.update()
    assert meter.state.hard_target_contacts == 2


@given(st.floats(-8, 8), st.floats(-8, 8), st.floats(0, 6))
def test_distance_to_the_box_is_zero_inside_and_grows_with_height_above_it(x, y, z):
    cx, cy, _ = TARGET_BOX.center_w
    inside = abs(x - cx) <= TARGET_BOX.half_extent_m[0] and abs(y - cy) <= TARGET_BOX.half_extent_m[1]
    distance = distance_to_box_m(np.array([x, y, z]))
    assert (distance == 0.0) == (inside and z <= TARGET_BOX.wall_height_m)
    assert distance_to_box_m(np.array([x, y, z + 7.0])) >= 5.9


@pytest.mark.parametrize(("x", "z", "depth"), [(0.0, -0.3, 0.3), (0.0, 0.2, 0.0), (DIG_AREA_EXTENT_M[0], -0.3, 0.0)])
def test_depth_is_measured_inside_the_dig_area_only(x, z, depth):
    assert depth_below_dig_plane_m(tool_at(np.array([x, 0.0, z]))) == pytest.approx(depth)
