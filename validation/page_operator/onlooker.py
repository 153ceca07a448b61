"""Somebody who looks on: reads every moment that the console publishes."""

import json
import re
import threading
import time
from collections.abc import Callable
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect


class Onlooker:
    """Reads the moments of a console in a thread of its own.

    Args:
        address: What the console printed.

    Attributes:
        state: The newest moment.
    """

    def __init__(self, address: str) -> None:
        found = re.fullmatch(r"http://([\w.:]+)/\?token=(\S+)", address)
        assert found, address
        host, token = found.groups()
        self._socket = connect(f"ws://{host}/live?token={token}", origin=f"http://{host}", max_size=None)  # type: ignore[arg-type]
        self.state: dict[str, Any] = {}
        threading.Thread(target=self._read, daemon=True).start()

    def wait(self, condition: Callable[[dict[str, Any]], bool], limit_s: float = 60.0) -> None:
        """Wait for a moment.

        Raises:
            TimeoutError: It does not come in time.
        """
        deadline = time.monotonic() + limit_s
        while not (self.state and condition(self.state)):
            if time.monotonic() > deadline:
                raise TimeoutError(f"what was waited for did not come; the page says {self.state.get('words')!r}")
            time.sleep(0.01)

    def close(self) -> None:
        """Leave."""
        self._socket.close()

    def _read(self) -> None:
        try:
            while True:
                message = self._socket.recv()
                assert isinstance(message, bytes)
                state = json.loads(message[4 : 4 + int.from_bytes(message[:4], "little")])
                self._socket.send(json.dumps({"kind": "seen", "number": state["number"]}))
                self.state = state
        except ConnectionClosed:
            return
