"""Stop the machine of the test bed at once, whoever drives it; it stays stopped.

Sends the emergency stop of the protocol until the machine says that it is latched. From then on it stands still,
whatever another program tells it. `--robot.release_stop=true` releases it when a robot connects the next time.

Keep a terminal ready with this command while a policy drives. It comes beside the stop that is wired to the machine,
never in its place: a network can fail. Then this command says so every three seconds, and tries on until Ctrl-C.

Examples:
  lerobot-excav testbed-stop
      the machine, or the emulator, at 127.0.0.1:47500
  lerobot-excav testbed-stop --address=192.168.1.20:47500
"""

import contextlib
import sys
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

NEEDS_PLUGINS = False  # a stop does not wait for other packages, nor fails with them

PATIENCE_S = 3.0
"""How long the machine may take to answer before that is told [s] (kind: guess: 150 datagrams)."""


@dataclass(kw_only=True)
class TestbedStopArguments(Arguments):
    """Arguments of `lerobot-excav testbed-stop`."""

    address: str = setting("Address and port of the machine's datagrams", default=USUAL_ADDRESS)

    def __post_init__(self) -> None:
        super().__post_init__()
        host_and_port(self.address, "--address")


def run(arguments: TestbedStopArguments) -> int:
    """Send the stop until it is latched."""
    while (why := _attempt(arguments.address)) is not None:
        _say(
            f"THE MACHINE at {arguments.address} DOES NOT SAY THAT IT IS STOPPED ({why}). Use the stop that is wired "
            "to it. Trying on; Ctrl-C ends this."
        )
    print(f"the machine at {arguments.address} is stopped, and stays so until --robot.release_stop=true releases it")
    return 0


def _say(words: str) -> None:
    with contextlib.suppress(OSError):  # nobody may listen any more; the stop goes on
        print(words, file=sys.stderr, flush=True)


def _attempt(address: str) -> str | None:
    """Send stops for `PATIENCE_S`, as a host of its own; return why the machine is not known to be stopped, or None."""
    link = HostLink(host_and_port(address, "--address"), dead_man=NeverHeld(), hold_s=STALE_S)
    link.stop()  # before the first datagram: none of this program may say anything else
    deadline, why, is_open = time.monotonic() + PATIENCE_S, "it is not heard", False
    with contextlib.closing(link):
        while time.monotonic() < deadline:
            try:
                if not is_open:  # no way there, perhaps: a cable is out
                    link.connect()
                    is_open = True
                if link.heard().state.flags & StateFlag.STOP_LATCHED:
                    return None
                why = "it answers, and the stop is not latched"
            except (DeviceError, OSError) as error:
                why = str(error) if error.__cause__ is not None or not is_open else "it is not heard"
            time.sleep(0.02)
    return why


ARGUMENTS = TestbedStopArguments
