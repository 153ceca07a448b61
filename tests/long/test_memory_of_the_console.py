"""The console's memory does not grow while somebody drives for half an hour.

Not part of the default run. `EXCAV_MINUTES` shortens it.
"""

import os
import random
import time

import pytest

from validation.page_operator.socket_page import ConsoleProcess, SocketPage

MINUTES = float(os.environ.get("EXCAV_MINUTES", "30"))
WARM_PART = 0.2
"""Of the time, after which buffers, caches and the soil's parcels have their sizes."""
MOST_GROWTH = 0.05


@pytest.mark.slow
def test_half_an_hour_of_driving_leaves_the_memory_as_it_is():
    console = ConsoleProcess("--env.type=excavator", "--env.fidelity=fast", "--env.scene_set=train")
    page, rng = SocketPage(console.address, drives=True), random.Random(0)
    start_s, warm_mb, scene = time.monotonic(), None, 0
    try:
        while (passed := (time.monotonic() - start_s) / (60.0 * MINUTES)) < 1.0:
            page.axes = [0.0] * 4
            page.wish("start", scene_id=scene)
            page.wait(lambda state, scene=scene: state["scene"]["scene_id"] == scene)
            page.wish("drive")
            page.wait(lambda state: state["mode"] == "drive" and state["ready"])
            drive(page, rng, seconds=min(20.0, 6.0 * MINUTES))
            warm_mb = console.rss_mb() if warm_mb is None and passed > WARM_PART else warm_mb
            print(f"{60 * passed * MINUTES:.0f} s: {console.rss_mb():.0f} MB", flush=True)
            scene += 1
        assert console.rss_mb() < (1.0 + MOST_GROWTH) * warm_mb, f"{warm_mb:.0f} MB grew to {console.rss_mb():.0f} MB"
    finally:
        console.kill()
        page.close()


def drive(page, rng, seconds):
    """Move the sticks at random: the machine digs, spills and runs against its stops."""
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s and not page.state["over"]:
        page.axes = [rng.uniform(-1.0, 1.0) for _ in range(4)]
        time.sleep(0.5)
