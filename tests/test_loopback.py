"""Which addresses reach this computer alone."""

import pytest

from lerobot_excav.loopback import is_loopback


@pytest.mark.parametrize(
    ("host", "expected"),
    [
        ("127.0.0.1", True),
        ("127.9.9.9", True),
        ("::1", True),
        ("localhost", True),
        ("0.0.0.0", False),
        ("10.0.0.1", False),
        ("2001:db8::1", False),
        ("x", False),
        ("", False),
    ],
)
def test_loopback_is_told_from_other_addresses_and_names(host, expected):
    assert is_loopback(host) is expected
