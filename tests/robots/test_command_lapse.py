"""A warning for commands that lapse before the next one comes."""

import pytest

from lerobot_excav.robots.excavator_testbed.command_lapse import FRAMES, CommandLapse


def warned_at(caplog, times_s, way_s):
    """Return after how many commands there was a warning, and how many there were."""
    lapse, first = CommandLapse(), None
    for number, now_s in enumerate(times_s):
        lapse.note(now_s, way_s)
        first = number if first is None and caplog.records else first
    return first, len(caplog.records)


@pytest.mark.parametrize(
    ("fps", "way_ms", "is_told"),
    [
        (10, 45, False),
        (10, 55, True),
        (25, 105, False),
        (25, 115, True),
        (50, 125, False),
        (50, 135, True),
        (5, 0, True),
    ],
)
def test_what_a_frame_and_the_way_take_together_is_held_against_a_commands_life(caplog, fps, way_ms, is_told):
    times_s = [number / fps for number in range(100)]
    first, count = warned_at(caplog, times_s, 1e-3 * way_ms)
    assert (first, count) == ((FRAMES, 1) if is_told else (None, 0))


def test_single_late_frames_are_no_reason(caplog):
    times_s = [0.1 * number + (5.0 if number >= 50 else 0.0) for number in range(100)]
    assert warned_at(caplog, times_s, 0.01) == (None, 0)
