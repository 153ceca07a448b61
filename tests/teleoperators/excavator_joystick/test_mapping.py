"""Sticks become commands: dead-zone, response and the two control patterns."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.teleoperators.excavator_joystick.mapping import AXES, PressDetector, StickMapping, respond

deflections = st.floats(-1.5, 1.5)
dead_zones = st.floats(0.0, 0.9)
expos = st.floats(0.0, 1.0)
CENTRED = dict.fromkeys(AXES, 0.0)


@given(deflections, dead_zones, expos)
def test_the_response_keeps_range_and_sign(value: float, dead_zone: float, expo: float) -> None:
    command = respond(value, dead_zone=dead_zone, expo=expo)
    assert abs(command) <= 1.0
    assert command == 0.0 or math.copysign(1.0, command) == math.copysign(1.0, value)
    assert respond(-value, dead_zone=dead_zone, expo=expo) == -command


@given(dead_zones, expos, st.floats(0.0, 1.0))
def test_within_the_dead_zone_nothing_moves(dead_zone: float, expo: float, share: float) -> None:
    assert respond(share * dead_zone, dead_zone=dead_zone, expo=expo) == 0.0


@given(dead_zones, expos)
def test_full_deflection_is_full_speed(dead_zone: float, expo: float) -> None:
    assert respond(1.0, dead_zone=dead_zone, expo=expo) == pytest.approx(1.0)
    assert respond(-32768 / 32767, dead_zone=dead_zone, expo=expo) == pytest.approx(-1.0)


@given(deflections, dead_zones, expos, st.floats(0.0, 1e-3))
def test_the_response_has_no_step_and_never_falls(
    value: float, dead_zone: float, expo: float, more: float
) -> None:
    before, after = (respond(v, dead_zone=dead_zone, expo=expo) for v in (value, value + more))
    steepest = 3.0 / (1.0 - dead_zone)  # of the cubic at full deflection
    assert -1e-12 <= after - before <= steepest * more + 1e-12


def test_expo_is_finer_near_the_centre() -> None:
    assert respond(0.3, dead_zone=0.0, expo=1.0) == pytest.approx(0.027)
    assert respond(0.3, dead_zone=0.0) == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("pattern", "axis", "joint", "sign"),
    [
        # Lever positions as an operator knows them; SDL's x is positive to the right, y towards the operator.
        ("iso", "left_x", "swing", -1),
        ("iso", "left_y", "arm", -1),
        ("iso", "right_x", "bucket", 1),
        ("iso", "right_y", "boom", 1),
        ("sae", "left_x", "swing", -1),
        ("sae", "left_y", "boom", 1),
        ("sae", "right_x", "bucket", 1),
        ("sae", "right_y", "arm", -1),
    ],
)
def test_each_axis_drives_one_joint(pattern: str, axis: str, joint: str, sign: int) -> None:
    command = StickMapping(pattern=pattern).command(CENTRED | {axis: 1.0})
    assert command == dict.fromkeys(("swing", "boom", "arm", "bucket"), 0.0) | {joint: float(sign)}


def test_iso_levers_do_what_an_operator_expects() -> None:
    forward, back, left = -1.0, 1.0, -1.0
    mapping = StickMapping(pattern="iso")
    assert mapping.command(CENTRED | {"left_x": left})["swing"] > 0.0  # swings to the left
    assert mapping.command(CENTRED | {"left_y": forward})["arm"] > 0.0  # reaches out
    assert mapping.command(CENTRED | {"right_y": back})["boom"] > 0.0  # lifts
    assert mapping.command(CENTRED | {"right_x": left})["bucket"] < 0.0  # curls


def test_inverting_an_axis_turns_its_joint_around() -> None:
    axes = CENTRED | {"left_y": 1.0, "right_y": 1.0}
    plain, inverted = StickMapping().command(axes), StickMapping(invert=("left_y",)).command(axes)
    assert inverted == plain | {"arm": -plain["arm"]}


def test_centred_sticks_give_plain_zeros() -> None:
    assert str(StickMapping().command(CENTRED)) == "{'swing': 0.0, 'boom': 0.0, 'arm': 0.0, 'bucket': 0.0}"


def test_a_held_button_is_one_press() -> None:
    detector = PressDetector()
    states = [False, True, True, False, True]
    assert [detector.pressed("a", is_down=down) for down in states] == [False, True, False, False, True]


def test_a_button_held_from_the_start_is_no_press() -> None:
    detector = PressDetector()
    assert [detector.pressed("a", is_down=down) for down in (True, False, True)] == [False, False, True]
