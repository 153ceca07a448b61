"""`lerobot-excav console` in a process of its own, and a page without a browser that drives it over its socket."""

import itertools
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

SEND_S = 0.02
PROGRAM = "import sys; from lerobot_excav.scripts.main import main; sys.exit(main(sys.argv[1:]))"


def until(condition, limit_s=300.0):
    deadline = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < deadline, "it did not come"
        time.sleep(0.01)


class ConsoleProcess:
    """The command, in a process group of its own."""

    def __init__(self, *flags):
        self._process = subprocess.Popen(
            [sys.executable, "-u", "-c", PROGRAM, "console", "--port=0", *flags],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, encoding="utf-8", start_new_session=True,
        )  # fmt: skip
        self.pid, self.said = self._process.pid, []
        self.address = self._read_address()

    def _read_address(self):
        for line in self._process.stdout:
            self.said.append(line)
            if found := re.search(r"the console is at (http://\S+)", line):
                return found[1]
        raise AssertionError("".join(self.said))

    def rss_mb(self):
        with open(f"/proc/{self.pid}/status", encoding="utf-8") as status:
            return int(re.search(r"VmRSS:\s+(\d+) kB", status.read())[1]) / 1024.0

    def kill(self):
        os.killpg(self.pid, signal.SIGKILL)
        self._process.wait()
        self._process.stdout.close()


class Page:
    """Takes the controls, sends the sticks as the page does, and reads every moment."""

    def __init__(self, address):
        host, token = re.fullmatch(r"http://([\d.:]+)/\?token=(\S+)", address).groups()
        self._socket = connect(f"ws://{host}/live?token={token}", origin=f"http://{host}", max_size=None)
        self.state, self.axes = {}, [0.0] * 4
        self._is_open, self._numbers = True, itertools.count()
        self.say(kind="take", force=False)
        self.say(kind="response", pattern="iso", dead_zone=0.08, expo=0.0, invert=[])
        self._threads = [threading.Thread(target=run, daemon=True) for run in (self._read, self._send)]
        for thread in self._threads:
            thread.start()
        until(lambda: self.state.get("ready"))

    def say(self, **message):
        self._socket.send(json.dumps(message))

    def wish(self, kind, **values):
        self.say(kind=kind, values=values)

    def close(self):
        self._is_open = False
        self._socket.close()

    def _read(self):
        while self._is_open:
            try:
                message = self._socket.recv()
                length = int.from_bytes(message[:4], "little")
                self.state = json.loads(message[4 : 4 + length])
                self.say(kind="seen", number=self.state["number"])
            except ConnectionClosed:
                return

    def _send(self):
        while self._is_open:
            try:
                self.say(kind="sticks", axes=list(self.axes), number=next(self._numbers))
            except ConnectionClosed:
                return
            time.sleep(SEND_S)
