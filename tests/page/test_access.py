"""Who may open the page."""

import socket

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.errors import DeviceError
from lerobot_excav.page.access import Access, free_port, outward_address

LOCAL = Access(host="127.0.0.1", port=8750, token="secret")
OPEN = Access(host="0.0.0.0", port=8750, token="secret")


def test_the_address_holds_the_token_and_tokens_differ():
    assert LOCAL.address == "http://127.0.0.1:8750/?token=secret"
    assert OPEN.address == f"http://{outward_address()}:8750/?token=secret"
    assert OPEN.is_for_us({"host": f"{outward_address()}:8750"})
    tokens = {Access(host="::1", port=1).token for _ in range(20)}
    assert len(tokens) == 20
    assert min(map(len, tokens)) >= 20
    assert Access(host="::1", port=1, token="t").address == "http://[::1]:1/?token=t"


@given(st.text(max_size=30))
def test_only_the_token_itself_is_known(text):
    assert LOCAL.knows_token({"token": text}, {}) == (text == "secret")
    assert LOCAL.knows_token({}, {LOCAL.cookie: text}) == (text == "secret")


@pytest.mark.parametrize(
    ("headers", "local", "open_"),
    [
        ({"host": "127.0.0.1:8750"}, True, True),
        ({"host": "localhost:8750", "origin": "http://localhost:8750"}, True, True),
        ({"host": "[::1]:8750"}, True, True),
        ({"host": "127.0.0.1:8750", "origin": "http://evil.example"}, False, False),
        ({"host": "127.0.0.1:8750", "origin": "http://127.0.0.1:9999"}, False, False),
        ({"host": "127.0.0.1:8750", "origin": "null"}, False, False),
        ({"host": "evil.example:8750"}, False, False),  # a name of someone else that leads here
        ({"host": "127.0.0.1"}, False, False),  # of port 80
        ({}, False, False),
        ({"host": "192.168.1.20:8750", "origin": "http://192.168.1.20:8750"}, False, True),
        ({"host": "192.168.1.20:8750", "origin": "http://192.168.1.21:8750"}, False, False),
    ],
)
def test_a_request_names_this_server_and_comes_from_its_own_page(headers, local, open_):
    assert LOCAL.is_for_us(headers) == local
    assert OPEN.is_for_us(headers) == open_


def test_the_port_of_http_is_left_out_by_browsers_and_each_port_has_its_own_cookie():
    plain = Access(host="127.0.0.1", port=80, token="secret")
    assert plain.is_for_us({"host": "127.0.0.1", "origin": "http://127.0.0.1"})
    assert plain.is_for_us({"host": "[::1]"})
    assert not plain.is_for_us({"host": "127.0.0.1:8080"})
    assert plain.cookie != LOCAL.cookie


def test_a_free_port_is_found():
    assert 1024 <= free_port("127.0.0.1") <= 65535
    if socket.has_ipv6:
        assert 1024 <= free_port("::1") <= 65535
    with pytest.raises(DeviceError, match=r"--host=203\.0\.113\.7 is no address of this machine"):
        free_port("203.0.113.7")
