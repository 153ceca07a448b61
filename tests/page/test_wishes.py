"""Messages of a page are checked before anything acts on them."""

import contextlib
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.page.drivers_seat import MOST_WISHES, DriversSeat
from lerobot_excav.page.wishes import ResponseMessage, SticksMessage, Wish, read_message

STICKS = {"kind": "sticks", "axes": [0.0, 0.5, -1.0, 1.0], "number": 3}


def test_messages_are_read_by_their_kind():
    assert read_message(json.dumps(STICKS)) == SticksMessage(kind="sticks", axes=[0.0, 0.5, -1.0, 1.0], number=3)
    assert read_message('{"kind": "point", "x": 0.5, "y": 1.0}') == Wish(kind="point", x=0.5, y=1.0)


@pytest.mark.parametrize(
    "message",
    [
        *("", "[]", "{}", "null", '{"kind": "explode"}', '{"kind": "sticks"}'),
        json.dumps(STICKS | {"axes": [0.0, 0.0, 0.0]}),
        json.dumps(STICKS | {"axes": [0.0, 0.0, 0.0, 1.5]}),
        json.dumps(STICKS | {"axes": [0.0, 0.0, 0.0, None]}),
        '{"kind": "sticks", "axes": [0, 0, 0, NaN], "number": 1}',
        json.dumps(STICKS | {"number": "3"}),
        json.dumps(STICKS | {"more": 1}),
        '{"kind": "point", "x": -0.1, "y": 0.5}',
        '{"kind": "target", "number": -1}',
        '{"kind": "start", "values": {"scene_id": 1.5}}',
        '{"kind": "response", "pattern": "mine", "dead_zone": 0.1, "expo": 0, "invert": []}',
    ],
)
def test_what_is_no_message_is_refused(message):
    with pytest.raises(ValueError, match=r"validation error|Invalid JSON"):
        read_message(message)


@given(st.text(max_size=200))
def test_no_text_does_more_than_be_refused(text):
    with contextlib.suppress(ValueError):
        read_message(text)


def test_one_page_drives_and_what_others_send_is_left_out():
    seat = DriversSeat()
    assert seat.take(1)
    assert not seat.take(2)
    seat.wish(2, Wish(kind="stop"))
    seat.report(2, [1.0] * 4, 7, lost=False)
    seat.respond(2, ResponseMessage(kind="response", pattern="sae", dead_zone=0.2, expo=0.0, invert=[]))
    assert seat.wishes() == []
    assert seat.sticks.number == -1
    assert seat.response.pattern == "iso"
    assert seat.take(2, force=True)
    seat.wish(1, Wish(kind="work"))
    seat.wish(2, Wish(kind="stop"))
    assert [wish.kind for wish in seat.wishes()] == ["stop"]
    assert seat.wishes() == []
    generation = seat.generation
    seat.leave(1)
    assert (seat.driver, seat.generation) == (2, generation)
    seat.leave(2)
    assert seat.driver is None
    assert seat.generation > generation


def test_whoever_takes_or_leaves_the_controls_starts_from_centred_sticks():
    seat = DriversSeat()
    seat.take(1)
    for number in range(20):
        seat.report(1, [0.0] * 4, number, lost=False)
    assert seat.sticks.is_ready
    seat.take(1)  # once more changes nothing
    assert seat.sticks.is_ready
    seat.report(1, [0.0] * 4, 20, lost=True)
    assert not seat.sticks.is_ready
    for number in range(20):
        seat.report(1, [0.0] * 4, number, lost=False)
    seat.wish(1, Wish(kind="work"))
    seat.take(2, force=True)
    assert not seat.sticks.is_ready
    assert seat.wishes() == []


def test_wishes_do_not_pile_up():
    seat = DriversSeat()
    seat.take(1)
    for _ in range(10 * MOST_WISHES):
        seat.wish(1, Wish(kind="stop"))
    assert len(seat.wishes()) == MOST_WISHES
