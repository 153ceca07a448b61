"""The server of the page, over real sockets."""

import json
import time
import urllib.error
import urllib.request

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from lerobot_excav.errors import DeviceError
from lerobot_excav.page.access import Access
from lerobot_excav.page.drivers_seat import DriversSeat
from lerobot_excav.page.feed import Feed
from lerobot_excav.page.server import STATIC, PageServer


def get(server, path, **headers):
    request = urllib.request.Request(f"http://127.0.0.1:{server.access.port}{path}", headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=10.0) as response:
            return response.status, response.read().decode(), dict(response.headers)
    except urllib.error.HTTPError as error:
        return error.code, error.read().decode(), dict(error.headers)


def open_socket(server, *, token="secret", origin=None, host=None):
    port = server.access.port
    return connect(f"ws://{host or '127.0.0.1'}:{port}/live?token={token}", origin=origin or f"http://127.0.0.1:{port}")


def decoded(message):
    length = int.from_bytes(message[:4], "little")
    header, data = json.loads(message[4 : 4 + length]), message[4 + length :]
    pictures = {}
    for name, size in header["pictures"]:
        pictures[name], data = data[:size], data[size:]
    assert data == b""
    return header, pictures


def say(socket, **message):
    socket.send(json.dumps(message))


def cookie(server):
    return {"Cookie": f"{server.access.cookie}=secret"}


def until(condition, limit_s=5.0):
    deadline = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def test_the_page_is_shown_to_who_knows_the_token_and_the_token_leaves_the_address_bar(server):
    assert get(server, "/")[0] == 401
    assert get(server, "/?token=wrong")[0] == 401
    status, text, headers = get(server, "/", **cookie(server))
    assert (status, "<!doctype html>" in text) == (200, True)
    assert "default-src 'self'" in headers["content-security-policy"]
    opener = urllib.request.build_opener(
        type("Stay", (urllib.request.HTTPRedirectHandler,), {"redirect_request": lambda *_: None})
    )
    with pytest.raises(urllib.error.HTTPError) as redirected:
        opener.open(f"http://127.0.0.1:{server.access.port}/?token=secret", timeout=10.0)
    assert redirected.value.headers["location"] == "/"
    told = redirected.value.headers["set-cookie"].lower()
    assert "httponly" in told
    assert "samesite=lax" in told


def test_every_file_of_the_page_is_served_and_nothing_else(server):
    for path in STATIC.iterdir():
        assert get(server, f"/{path.name}", **cookie(server))[0] == 200
        assert get(server, f"/{path.name}")[0] == 401
    for path in ("/nothing.js", "/..%2Fserver.py", "/%2e%2e/server.py", "/static/app.js"):
        assert get(server, path, **cookie(server))[0] == 404


def test_a_name_of_someone_else_that_leads_here_is_refused(server):
    assert get(server, "/", Host=f"evil.example:{server.access.port}", **cookie(server))[0] == 403


@pytest.mark.parametrize("wrong", [{"token": "wrong"}, {"origin": "http://evil.example"}])
def test_a_socket_without_the_token_or_from_another_page_is_refused(server, wrong):
    with pytest.raises((InvalidStatus, ConnectionClosed)), open_socket(server, **wrong) as socket:
        socket.recv(timeout=5.0)


def test_moments_arrive_whole_and_say_who_drives(server):
    server.feed.publish({"words": "grüß"}, {"main": b"\xff\xd8abc", "plan": b""})
    with open_socket(server) as first, open_socket(server) as second:
        header, pictures = decoded(first.recv(timeout=5.0))
        assert (header["words"], header["driver"], pictures) == (
            "grüß",
            "nobody",
            {"main": b"\xff\xd8abc", "plan": b""},
        )
        say(first, kind="take")
        until(lambda: server.seat.driver is not None)
        server.feed.publish({}, {})
        assert decoded(first.recv(timeout=5.0))[0]["driver"] == "you"
        decoded(second.recv(timeout=5.0))
        server.feed.publish({}, {})
        say(second, kind="seen", number=1)
        assert decoded(second.recv(timeout=5.0))[0]["driver"] == "another page"


def test_pictures_that_have_not_changed_are_not_sent_again(server):
    pictures = {"main": b"abc"}
    with open_socket(server) as socket:
        shown = []
        for number, published in enumerate((pictures, pictures, {"main": b"abc"}), start=1):
            server.feed.publish({}, published)
            shown.append(decoded(socket.recv(timeout=5.0))[1])
            say(socket, kind="seen", number=number)
    assert shown == [{"main": b"abc"}, {}, {"main": b"abc"}]


def test_a_page_that_does_not_draw_gets_two_moments_and_then_the_newest_nothing_is_queued(server):
    with open_socket(server) as socket:
        numbers = []
        for _ in range(50):
            server.feed.publish({}, {"main": b"x" * 100_000})
            time.sleep(0.01)
        numbers.append(decoded(socket.recv(timeout=5.0))[0]["number"])
        numbers.append(decoded(socket.recv(timeout=5.0))[0]["number"])
        with pytest.raises(TimeoutError):
            socket.recv(timeout=0.3)
        say(socket, kind="seen", number=numbers[-1])
        assert decoded(socket.recv(timeout=5.0))[0]["number"] == 50


def test_a_page_that_is_closed_lets_go_of_the_controls(server):
    with open_socket(server) as socket:
        say(socket, kind="take")
        for number in range(20):
            say(socket, kind="sticks", axes=[0.0, 0.0, 0.0, 0.0], number=number)
        until(lambda: server.seat.sticks.is_ready)
    until(lambda: server.seat.driver is None)
    assert not server.seat.sticks.is_ready
    until(lambda: not server.open_pages)


@pytest.mark.parametrize("text", ["nonsense", '{"kind": "sticks", "axes": [9, 0, 0, 0], "number": 1}', b"\x00\x01"])
def test_a_page_that_sends_nonsense_is_closed_and_loses_the_controls(server, text):
    with open_socket(server) as socket:
        say(socket, kind="take")
        until(lambda: server.seat.driver is not None)
        socket.send(text)
        with pytest.raises(ConnectionClosed):
            socket.recv(timeout=5.0)
    until(lambda: server.seat.driver is None)


def test_a_message_that_is_too_long_is_not_read(server):
    with open_socket(server) as socket:
        socket.send("x" * 2_000_000)
        with pytest.raises(ConnectionClosed):
            socket.recv(timeout=5.0)


def test_a_port_that_is_taken_is_named(server):
    with (
        pytest.raises(DeviceError, match=f"127.0.0.1:{server.access.port}"),
        PageServer(Access(host="127.0.0.1", port=server.access.port), Feed(), DriversSeat()).running(),
    ):
        pass
