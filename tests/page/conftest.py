"""A page server without anything behind it."""

import pytest

from lerobot_excav.page.access import Access, free_port
from lerobot_excav.page.drivers_seat import DriversSeat
from lerobot_excav.page.feed import Feed
from lerobot_excav.page.server import PageServer


@pytest.fixture
def server():
    access = Access(host="127.0.0.1", port=free_port("127.0.0.1"), token="secret")
    feed, seat = Feed(), DriversSeat()
    with PageServer(access, feed, seat).running() as running:
        running.feed, running.seat = feed, seat
        yield running
