"""Sticks become commands: dead-zone, response and the two control patterns."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.envs.tasks.scoop.sticks import joint_commands
from lerobot_excav.envs.tasks.sticks import AXES, StickResponse, respond

deflections = st.floats(-1.5, 1.5)
dead_zones = st.floats(0.0, 0.9)
expos = st.floats(0.0, 1.0)
CENTRED = dict.fromkeys(AXES, 0.0)


@given(deflections, dead_zones, expos)
def test_the_response_keeps_range_and_sign(value, dead_zone, expo):
    command = respond(value, dead_zone=dead_zone, expo=expo)
    assert abs(command) <= 1.0
    assert command == 0.0 or math.copysign(1.0, command) == math.copysign(1.0, value)
    assert respond(-value, dead_zone=dead_zone, expo=expo) == -command


@given(dead_zones, expos, st.floats(0.0, 1.0))
def test_nothing_moves_within_the_dead_zone_and_full_deflection_is_full_speed(dead_zone, expo, share):
    values = (share * dead_zone, 1.0, -32768 / 32767)
    commands = [respond(value, dead_zone=dead_zone, expo=expo) for value in values]
    assert commands == [0.0, pytest.approx(1.0), pytest.approx(-1.0)]


@given(deflections, dead_zones, expos, st.floats(0.0, 1e-3))
def test_the_response_has_no_step_and_never_falls(value, dead_zone, expo, more):
    before, after = (respond(v, dead_zone=dead_zone, expo=expo) for v in (value, value + more))
    steepest = 3.0 / (1.0 - dead_zone)  # of the cubic at full deflection
    assert -1e-12 <= after - before <= steepest * more + 1e-12


@pytest.mark.parametrize(
    ("pattern", "axis", "joint", "sign"),
    [
        # As an operator knows the levers; SDL's x is positive to the right, y towards the operator.
        ("iso", "left_x", "swing", -1),  # right: swings to the right
        ("iso", "left_y", "arm", -1),  # back: pulls in
        ("iso", "right_x", "bucket", 1),  # right: opens
        ("iso", "right_y", "boom", 1),  # back: lifts
        ("sae", "left_x", "swing", -1),
        ("sae", "left_y", "boom", 1),
        ("sae", "right_x", "bucket", 1),
        ("sae", "right_y", "arm", -1),
    ],
)
def test_each_axis_drives_one_joint_and_centred_sticks_give_plain_zeros(pattern, axis, joint, sign):
    still = "{'swing': 0.0, 'boom': 0.0, 'arm': 0.0, 'bucket': 0.0}"
    for invert, turned in (((), sign), ((axis,), -sign)):
        response = StickResponse(pattern=pattern, dead_zone=0.08, expo=0.0, invert=invert)
        command = joint_commands(CENTRED | {axis: 1.0}, response)
        assert command == dict.fromkeys(command, 0.0) | {joint: float(turned)}
        assert str(joint_commands(CENTRED, response)) == still
