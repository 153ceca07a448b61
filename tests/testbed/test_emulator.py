"""The emulated machine and a host over a real socket: what moves it, what does not, and what faults do."""

import socket
import time

import numpy as np
import pytest

from lerobot_excav.envs.tasks.scoop.settings import ExcavatorSettings
from lerobot_excav.errors import DeviceError
from lerobot_excav.testbed import emulated_site
from lerobot_excav.testbed.emulated_site import EmulatedSite
from lerobot_excav.testbed.emulator import EmulatedMachine
from lerobot_excav.testbed.faulty_wire import WireFaults
from lerobot_excav.testbed.picture_stream import PictureClient
from lerobot_excav.testbed.protocol import Command, CommandFlag, Refusal, StateFlag
from lerobot_excav.testbed.safety import STILL

from .conftest import SMALL, emulated, linked, until

pytestmark = pytest.mark.slow

LEFT = (1.0, 0.0, 0.0, 0.0)


def swing(link):
    return link.heard().state.joint_pos[0]


def is_armed(link):
    try:
        return bool(link.heard().state.flags & StateFlag.ARMED)
    except DeviceError:
        return False


def arm(link):
    link.let_go(lets_go=True)
    link.give(STILL)
    until(lambda: is_armed(link))
    link.let_go(lets_go=False)


def turned(link, seconds=0.6):
    """Command full swing, again and again as a robot does; return how far it went."""
    before, end_s = swing(link), time.monotonic() + seconds
    while time.monotonic() < end_s:
        link.give(LEFT)
        time.sleep(0.05)
    link.give(STILL)
    return swing(link) - before


def refused(served):
    return [refusal for _, refusal in served.emulator.refusals]


def test_it_moves_after_the_start_gate_and_stops_when_nobody_gives_commands():
    with emulated() as served, linked(served) as link:
        until(lambda: link.counts["heard"] > 5)
        assert abs(turned(link)) < 0.01  # not armed: the dead-man was held from the start
        arm(link)
        assert turned(link) > 0.03
        before = link.counts["held_too_long"]
        link.give(LEFT)
        until(lambda: link.counts["held_too_long"] > before)
        until(lambda: abs(link.heard().state.joint_vel[0]) < 0.02)  # it brakes for 1.5 s from full speed
        still = swing(link)
        time.sleep(0.3)
        assert abs(swing(link) - still) < 0.02


def test_a_host_that_dies_leaves_the_machine_standing_and_the_next_one_asks_again():
    with emulated() as served:
        with linked(served) as link:
            arm(link)
            turned(link)
        until(lambda: served.emulator.gate.is_armed is False)
        assert Refusal.NOT_HEARD in refused(served)
        with linked(served) as link:
            until(lambda: link.counts["heard"] > 5)
            assert abs(turned(link, 0.3)) < 0.01
            arm(link)
            assert turned(link) > 0.03


def test_the_emergency_stop_is_latched_on_the_machine():
    with emulated() as served, linked(served) as link:
        arm(link)
        link.stop()
        until(lambda: link.heard().state.refusal is Refusal.EMERGENCY_STOP)
        link._flags = CommandFlag.NONE  # a host that forgets it
        assert abs(turned(link, 0.3)) < 0.01
        assert served.emulator.gate.is_stopped
        link.let_go(lets_go=True)
        link.give(STILL)
        link.release()
        until(lambda: not served.emulator.gate.is_stopped)
        until(lambda: link._flags is CommandFlag.NONE)  # a later stop is not released by this wish
        served.emulator.gate.is_stopped = True
        time.sleep(0.5)
        assert served.emulator.gate.is_stopped


def test_a_wire_whose_dead_man_fails_says_so_to_whoever_uses_it():
    class Broken:
        def is_held(self):
            raise RuntimeError("the switch is broken")

    with emulated() as served, linked(served, dead_man=Broken()) as link:
        for use in (link.heard, link.stop, link.release, lambda: link.give(STILL)):
            until(lambda: link._fault is not None)
            with pytest.raises(DeviceError, match="has failed: RuntimeError"):
                use()


def test_while_the_next_pile_is_heaped_up_it_stands_and_goes_on_answering(monkeypatch):
    with emulated() as served, linked(served) as link:
        arm(link)
        show = served.site._show

        def slowly():
            time.sleep(1.5)
            show()

        monkeypatch.setattr(served.site, "_show", slowly)
        monkeypatch.setattr(served.site._env, "_frame", served.site._env.episode_length - 5)
        end_s = time.monotonic() + 4.0
        while not served.cycles and time.monotonic() < end_s:
            time.sleep(0.01)
        assert served.cycles
        for _ in range(20):
            link.heard()  # no silence of half a second
            time.sleep(0.05)
        assert link.heard().state.flags & StateFlag.ARMED


def test_a_port_that_is_taken_is_named():
    with emulated() as served:
        host, port = served.emulator.address
        for ports in ((port, 0), (0, served.emulator.picture_address[1])):
            with pytest.raises(DeviceError, match=r"cannot be listened at.*0 for any"):
                EmulatedSite(ExcavatorSettings(**SMALL), EmulatedMachine(), host=host, ports=ports)


@pytest.mark.parametrize(
    "faults",
    [
        {"loss": 0.3},
        {"delay_ms": 40.0},
        {"jitter_ms": 20.0},
        {"duplicates": 0.5},
        {"loss": 0.1, "delay_ms": 20.0, "jitter_ms": 10.0, "duplicates": 0.1},
    ],
)
def test_behind_a_bad_wire_it_is_armed_and_moves_and_stops(faults):
    with emulated(wire=WireFaults(**faults), seed=3) as served, linked(served) as link:
        arm(link)
        assert turned(link, 1.0) > 0.03
        until(lambda: abs(link.heard().state.joint_vel[0]) < 0.02)
        if "jitter_ms" in faults or "duplicates" in faults:
            assert link.counts["overtaken"] > 0


def test_commands_that_are_under_way_for_too_long_do_not_move_it_however_often_they_come():
    with emulated(wire=WireFaults(delay_ms=250.0)) as served, linked(served) as link:
        arm(link)
        assert link.offset.trip_us > 400_000
        assert abs(turned(link, 1.0)) < 0.01
        assert Refusal.STALE in refused(served)


def test_a_machine_that_is_gone_is_an_error_in_words():
    with emulated() as served:
        address = served.emulator.address
        with linked(served) as link:
            until(lambda: link.counts["heard"] > 5)
    with linked(served) as link:
        time.sleep(0.3)
        with pytest.raises(DeviceError, match=rf"the machine at {address[0]}:{address[1]} has not been heard"):
            link.heard()


def test_nonsense_from_strangers_changes_nothing():
    with emulated() as served, linked(served) as link:
        arm(link)
        stranger = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        rng = np.random.default_rng(0)
        for _ in range(200):
            stranger.sendto(rng.bytes(44), served.emulator.address)
        good = Command(session=1, number=1, host_us=0, axes=STILL).encode()
        stranger.sendto(good[:-1] + bytes([good[-1] ^ 1]), served.emulator.address)
        stranger.close()
        assert turned(link) > 0.03


def test_the_ages_of_states_are_those_of_the_wire():
    with emulated(wire=WireFaults(delay_ms=60.0)) as served, linked(served) as link:
        until(lambda: link.counts["heard"] > 100)
        heard = link.heard()
        age_ms = 1e-3 * (time.perf_counter_ns() // 1000 - heard.true_us)
        assert age_ms > 55.0  # the way back at least
        assert 95_000 < link.offset.trip_us < 400_000  # the machine looks every 20 ms


def test_pictures_come_by_name_the_mask_without_loss_and_unknown_names_never():
    with emulated() as served:
        mask = PictureClient(served.emulator.picture_address, "target_mask")
        mask.connect(5.0)
        picture = mask.next(5.0).pixels
        assert picture.shape == (48, 64, 3)
        assert set(np.unique(picture)) == {0, 255}
        main = PictureClient(served.emulator.picture_address, "main")
        main.connect(5.0)
        first, second = (main.next(5.0).taken_us for _ in range(2))
        assert second > first
        assert main.newest(5.0).pixels.std() > 5.0
        for client in (main, mask):
            client.close()
        with pytest.raises(DeviceError, match="no picture of 'rear' came"):
            PictureClient(served.emulator.picture_address, "rear").connect(0.5)
    with pytest.raises(DeviceError, match="cannot be reached"):
        PictureClient(served.emulator.picture_address, "main").connect(0.5)


def test_sensors_are_noisy_as_asked_and_the_seed_decides():
    with emulated(joint_noise_rad=0.01) as served, linked(served) as link:
        until(lambda: link.counts["heard"] > 5)
        seen = []
        for _ in range(60):
            seen.append(link.heard().state.joint_pos)
            time.sleep(0.03)
        assert 0.006 < np.std(np.unique(seen, axis=0), axis=0).mean() < 0.014


def test_the_next_scene_is_drawn_before_its_turn(monkeypatch):
    drawn = []
    monkeypatch.setattr(emulated_site, "draw_scene", lambda *place, soil, pile: drawn.append((*place, soil, pile)))
    with emulated({"scene_set": "val", "soil": "gravel", "pile": "ridge"}):
        until(lambda: drawn == [("val", 1, "gravel", "ridge")])


def test_a_mask_that_flickers_lies_elsewhere_at_every_tick():
    seen = set()
    with emulated({"mask_noise": "flicker", "mask_noise_px": 3}) as served:
        until(lambda: seen.add(served.site._mask_img().tobytes()) or len(seen) > 4)
