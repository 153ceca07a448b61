"""What a person does at the page: waits for something to come, and holds a key until it has."""

import time


def comes(condition, limit_s):
    deadline = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


def until(condition, limit_s=20.0):
    assert comes(condition, limit_s)


def state_of(served):
    return served.console.feed._moment.state


def is_driven(served):
    state = state_of(served)
    return state["mode"] == "drive" and state["ready"]


def hold(page, served, key, *, until):
    """Drive, and hold a key until a condition holds.

    On a busy machine the page may not be heard for a moment, which lets go of the sticks, or lose its connection, which
    stops the machine: who drives lets go and begins again, as the page says.
    """
    deadline = time.monotonic() + 180.0
    while not until():
        assert time.monotonic() < deadline, state_of(served)
        if not is_driven(served):
            page.locator("#drive").click()
            assert comes(lambda: is_driven(served), 60.0), state_of(served)
        page.keyboard.down(key)
        comes(lambda: until() or not is_driven(served), 60.0)
        page.keyboard.up(key)
