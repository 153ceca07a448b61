"""The console in a process of its own, and a page without a browser that looks on or drives over the socket."""

import itertools
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

SEND_S = 0.02
"""How often a page says where its sticks are [s]."""

PROGRAM = "import sys; from lerobot_excav.scripts.main import main; sys.exit(main(sys.argv[1:]))"


def wait_for(condition: Callable[[], Any], limit_s: float = 300.0) -> None:
    """Wait until something is so.

    Raises:
        TimeoutError: It does not come in time.
    """
    deadline = time.monotonic() + limit_s
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError("what was waited for did not come")
        time.sleep(0.01)


class ConsoleProcess:
    """`lerobot-excav console` in a process group of its own.

    Args:
        flags: Its options, without `--port`.

    Attributes:
        address: What it printed.
        pid: Number of the process.
    """

    def __init__(self, *flags: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-u", "-c", PROGRAM, "console", "--port=0", *flags],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, encoding="utf-8", start_new_session=True,
        )  # fmt: skip
        self.pid = self._process.pid
        self.address = self._read_address()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.kill()

    def rss_mb(self) -> float:
        """Return the memory that it holds [MB]."""
        with open(f"/proc/{self.pid}/status", encoding="utf-8") as status:
            found = re.search(r"VmRSS:\s+(\d+) kB", status.read())
        assert found
        return int(found[1]) / 1024.0

    def kill(self) -> None:
        """End it at once, as a power cut does."""
        if self._process.poll() is None:
            os.killpg(self.pid, signal.SIGKILL)
        self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()

    def _read_address(self) -> str:
        said = []
        assert self._process.stdout is not None
        for line in self._process.stdout:
            said.append(line)
            if found := re.search(r"the console is at (http://\S+)", line):
                return found[1]
        raise RuntimeError(f"the console did not start: {''.join(said)}")


class SocketPage:
    """Reads every moment of a console, and drives if asked to: it takes the controls and sends its sticks.

    Args:
        address: What the console printed.
        drives: Whether it takes the controls.

    Attributes:
        state: The newest moment.
        axes: Where the sticks are: left x and y, right x and y, each in [-1, 1].
    """

    def __init__(self, address: str, *, drives: bool) -> None:
        found = re.fullmatch(r"http://([\w.:]+)/\?token=(\S+)", address)
        assert found, address
        origin: Any = f"http://{found[1]}"
        self._socket = connect(f"ws://{found[1]}/live?token={found[2]}", origin=origin, max_size=None)
        self.state: dict[str, Any] = {}
        self.axes = [0.0] * 4
        self._numbers = itertools.count()
        if drives:
            self.say(kind="take", force=False)
            self.say(kind="response", pattern="iso", dead_zone=0.08, expo=0.0, invert=[])
        for run in (self._read, *([self._send] if drives else [])):
            threading.Thread(target=run, daemon=True).start()
        wait_for(lambda: self.state.get("ready") or (not drives and self.state))

    def say(self, **message: Any) -> None:
        """Send a message."""
        self._socket.send(json.dumps(message))

    def wish(self, kind: str, **values: int) -> None:
        """Wish for something."""
        self.say(kind=kind, values=values)

    def wait(self, condition: Callable[[dict[str, Any]], Any], limit_s: float = 300.0) -> None:
        """Wait for a moment.

        Raises:
            TimeoutError: It does not come in time.
        """
        try:
            wait_for(lambda: condition(self.state), limit_s)
        except TimeoutError:
            raise TimeoutError(f"it did not come in {limit_s:.0f} s; the page says {self.state['words']!r}") from None

    def record(self, sticks: Callable[[int], list[float]], frames: int) -> None:
        """Record the next start as a person does, and keep it; `sticks` tells where they are in a frame."""
        kept = self.state["recording"]["kept"]
        self.axes = [0.0] * 4
        self.wish("record")
        self.wait(lambda state: state["recording"]["running"] and state["ready"])
        while not self.state["over"] and self.state["recording"]["frames"] < frames:
            self.axes = sticks(self.state["frame"])
            time.sleep(SEND_S)
        self.axes = [0.0] * 4
        if not self.state["over"]:
            self.wish("finish")
        self.wait(lambda state: state["recording"]["verdict"] is not None)
        self.wish("keep")
        self.wait(lambda state: state["recording"]["kept"] > kept)

    def close(self) -> None:
        """Leave."""
        self._socket.close()

    def _read(self) -> None:
        try:
            while True:
                message = self._socket.recv()
                assert isinstance(message, bytes)
                state = json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])
                self.say(kind="seen", number=state["number"])
                self.state = state
        except ConnectionClosed:
            return

    def _send(self) -> None:
        try:
            while True:
                self.say(kind="sticks", axes=list(self.axes), number=next(self._numbers))
                time.sleep(SEND_S)
        except ConnectionClosed:
            return
