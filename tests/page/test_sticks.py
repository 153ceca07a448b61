"""When the sticks of the page count."""

from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.envs.tasks.sticks import AXES
from lerobot_excav.page.sticks import CENTRED, CENTRED_MESSAGES, LOST_S, STALE_S, Sticks

REST = dict.fromkeys(AXES, 0.0)
CENTRE, OVER = [0.0] * 4, [0.0, -1.0, 0.0, 0.0]
STEP_S = 0.02

deflections = st.floats(-1.0, 1.0)


def centred(at_s=0.0):
    """Sticks that were seen centred long enough, and the time."""
    sticks = Sticks()
    for number in range(CENTRED_MESSAGES):
        sticks.report(CENTRE, number, at_s + number * STEP_S)
    return sticks, at_s + (CENTRED_MESSAGES - 1) * STEP_S


def test_nothing_counts_before_a_first_message_and_before_the_sticks_were_centred():
    sticks = Sticks()
    assert sticks.axes(0.0) == REST
    for number in range(100):
        sticks.report(OVER, number, number * STEP_S)
    assert sticks.axes(99 * STEP_S) == REST
    assert not sticks.is_ready


def test_what_the_sticks_say_counts_once_they_were_centred():
    sticks, now_s = centred()
    sticks.report(OVER, 50, now_s + STEP_S)
    assert sticks.axes(now_s + STEP_S) == REST | {"left_y": -1.0}
    assert sticks.number == 50


def test_centred_means_all_axes_and_in_a_row():
    sticks = Sticks()
    for number in range(10 * CENTRED_MESSAGES):
        is_last_of_a_row = number % CENTRED_MESSAGES == CENTRED_MESSAGES - 1
        sticks.report([0.0, 0.0, 0.0, 2.0 * CENTRED if is_last_of_a_row else 0.0], number, number * STEP_S)
    assert not sticks.is_ready


@given(st.lists(deflections, min_size=4, max_size=4), st.floats(STALE_S + 1e-6, 100.0))
def test_a_stale_message_is_rest_and_never_the_last_command_again(axes, age_s):
    sticks, now_s = centred()
    sticks.report(axes, 50, now_s)
    assert sticks.axes(now_s + age_s) == REST


def test_after_a_short_gap_the_sticks_count_again_and_after_a_long_one_they_are_centred_first():
    sticks, now_s = centred()
    short_s = now_s + 2.0 * STALE_S
    sticks.report(OVER, 50, short_s)
    assert sticks.axes(short_s)["left_y"] == -1.0
    long_s = short_s + LOST_S + 0.1
    sticks.report(OVER, 51, long_s)
    assert sticks.axes(long_s) == REST


def test_letting_go_asks_for_centring_again():
    sticks, now_s = centred()
    sticks.let_go()
    sticks.report(OVER, 50, now_s)
    assert sticks.axes(now_s) == REST


def test_a_person_takes_over_with_a_stick_well_out_of_its_centre_and_not_by_resting_a_hand_on_it():
    sticks, now_s = centred()
    for value, takes in ((0.1, False), (0.25, False), (-0.5, True)):
        sticks.report([0.0, 0.0, value, 0.0], 50, now_s)
        assert sticks.take_over(now_s) == takes
    assert not sticks.take_over(now_s + 10.0)


def test_a_wider_dead_zone_lets_a_pad_drift_further():
    sticks = Sticks()
    for number in range(20):
        sticks.report([0.12, 0.0, 0.0, 0.0], number, number * STEP_S)
    assert not sticks.is_ready
    for number in range(20):
        sticks.report([0.12, 0.0, 0.0, 0.0], number, number * STEP_S, centred=0.15)
    assert sticks.is_ready


def test_a_page_is_heard_from_taking_the_controls_on_as_long_as_it_sends():
    sticks = Sticks(heard_since_s=1.0)
    assert sticks.is_heard(1.0 + 0.9 * LOST_S)
    assert not sticks.is_heard(1.0 + 1.1 * LOST_S)
    sticks.report(OVER, 1, 3.0)
    assert sticks.is_heard(3.0 + 0.9 * LOST_S)
    assert not sticks.is_heard(3.0 + 1.1 * LOST_S)
