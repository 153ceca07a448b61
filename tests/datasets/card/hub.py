"""A stand-in for the Hugging Face Hub on this machine: takes uploads, and keeps their files in memory."""

import base64
import json
import threading
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

COMMIT = 40 * "0"


class Hub(BaseHTTPRequestHandler):
    """One dataset, of which every file is uploaded as it is."""

    def do_POST(self):
        body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
        kind = self.path.split("?")[0].removeprefix("/api/")
        self.server.asked.append(("POST", kind))
        if kind == "repos/create":
            self.server.created = json.loads(body)
            self._answer({"url": f"{self.server.address}/datasets/someone/digging"})
        elif "/preupload/" in kind:
            named = [{"path": file["path"], "uploadMode": "regular"} for file in json.loads(body)["files"]]
            self._answer({"files": [file | {"shouldIgnore": False} for file in named]})
        elif "/commit/" in kind:
            for line in map(json.loads, body.splitlines()):
                if line["key"] == "file":
                    self.server.files[line["value"]["path"]] = base64.b64decode(line["value"]["content"])
            self._answer({"commitUrl": f"{self.server.address}/datasets/someone/digging/commit/{COMMIT}",
                          "commitOid": COMMIT, "hookOutput": "", "success": True})  # fmt: skip
        else:
            self._answer({})

    def do_DELETE(self):
        self.server.asked.append(("DELETE", self.path.removeprefix("/api/")))
        self._answer({})

    def do_GET(self):
        self._answer({"id": "someone/digging", "sha": COMMIT, "siblings": []})

    def _answer(self, content):
        data = json.dumps(content).encode()
        self.send_response(200)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, *_):
        """Say nothing."""


@contextmanager
def hub():
    server = ThreadingHTTPServer(("127.0.0.1", 0), Hub)
    server.address = f"http://127.0.0.1:{server.server_port}"
    server.asked, server.files, server.created = [], {}, None
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        thread.join()
        server.server_close()
