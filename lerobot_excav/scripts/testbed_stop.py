"""Stop the machine of the test bed at once, whoever drives it; it stays stopped.

Sends the emergency stop of the protocol until the machine says that it is latched. From then on it stands still,
whatever another program tells it. `--robot.release_stop=true` releases it when a robot connects the next time.

Keep a terminal ready with this command while a policy drives. It comes beside the stop that is wired to the machine,
never in its place: a network can fail.

Examples:
  lerobot-excav testbed-stop
      the machine, or the emulator, at 127.0.0.1:47500
  lerobot-excav testbed-stop --address=192.168.1.20:47500
"""

import time
from dataclasses import dataclass

from lerobot_excav.errors import DeviceError
from lerobot_excav.scripts.arguments import Arguments
from lerobot_excav.setting import setting
from lerobot_excav.testbed.address import USUAL_ADDRESS, host_and_port
from lerobot_excav.testbed.dead_man import NeverHeld
from lerobot_excav.testbed.host_link import HostLink
from lerobot_excav.testbed.protocol import StateFlag
from lerobot_excav.testbed.safety import STALE_S

PATIENCE_S = 3.0
"""How long the machine may take to answer [s] (kind: guess: 150 datagrams)."""


@dataclass(kw_only=True)
class TestbedStopArguments(Arguments):
    """Arguments of `lerobot-excav testbed-stop`."""

    address: str = setting("Address and port of the machine's datagrams", default=USUAL_ADDRESS)

    def __post_init__(self) -> None:
        super().__post_init__()
        host_and_port(self.address, "--address")


def run(arguments: TestbedStopArguments) -> int:
    """Send the stop until it is latched.

    Raises:
        DeviceError: The machine did not say so.
    """
    link = HostLink(host_and_port(arguments.address, "--address"), dead_man=NeverHeld(), hold_s=STALE_S)
    link.stop()  # before the first datagram: none of this program may say anything else
    link.connect()
    try:
        _wait_until_latched(link, arguments.address)
    finally:
        link.close()
    print(f"the machine at {arguments.address} is stopped, and stays so until --robot.release_stop=true releases it")
    return 0


def _wait_until_latched(link: HostLink, address: str) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        try:
            if link.heard().state.flags & StateFlag.STOP_LATCHED:
                return
        except DeviceError:  # not heard yet
            pass
        time.sleep(0.02)
    raise DeviceError(
        f"the machine at {address} did not say within {PATIENCE_S:.0f} s that it is stopped. Use the stop that is "
        "wired to it; then check the address and the cable."
    )


ARGUMENTS = TestbedStopArguments
