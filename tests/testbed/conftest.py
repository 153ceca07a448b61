"""An emulated machine on free ports, running in a thread while a test drives it."""

import threading
import time
from contextlib import contextmanager
from types import SimpleNamespace

from lerobot_excav.envs.tasks.scoop.settings import ExcavatorSettings
from lerobot_excav.testbed.dead_man import AlwaysHeld
from lerobot_excav.testbed.emulated_site import EmulatedSite
from lerobot_excav.testbed.emulator import EmulatedMachine
from lerobot_excav.testbed.host_link import HostLink
from lerobot_excav.testbed.safety import STALE_S
from lerobot_excav.testbed.valves import Valves

SMALL = {"fidelity": "fast", "observation_height": 48, "observation_width": 64}


def until(condition, limit_s=20.0):
    deadline = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@contextmanager
def emulated(settings=None, port=0, *, has_depth=False, **machine):
    """Run a machine without soak; its metrics are collected in `cycles`."""
    cycles, over = [], threading.Event()
    machine = {"soak_s": 0.0, "valves": Valves(lag_s=0.05), "pictures_hz": 10, **machine}
    site = EmulatedSite(
        ExcavatorSettings(**{**SMALL, "scene_set": "train", **(settings or {})}),
        EmulatedMachine(**machine),
        ports=(port, 0),
        has_depth=has_depth,
        on_over=cycles.append,
    )
    thread = threading.Thread(target=site.emulator.run, args=(over.is_set,), daemon=True)
    thread.start()

    def stop():
        if not over.is_set():
            over.set()
            thread.join(timeout=20.0)
            site.close()

    try:
        yield SimpleNamespace(emulator=site.emulator, site=site, cycles=cycles, has_depth=has_depth, stop=stop)
    finally:
        stop()


@contextmanager
def linked(served, dead_man=None, hold_s=STALE_S, **options):
    """Open a wire to a machine."""
    link = HostLink(served.emulator.address, dead_man=dead_man or AlwaysHeld(), hold_s=hold_s, **options)
    link.connect()
    try:
        yield link
    finally:
        link.close()
