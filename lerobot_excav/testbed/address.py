"""Addresses of machines: an IPv4 address and a port."""

import ipaddress

from lerobot_excav.errors import ConfigurationError

USUAL_PORT = 47500
"""Port of a machine's datagrams (kind: guess; not registered to anybody)."""

USUAL_ADDRESS = f"127.0.0.1:{USUAL_PORT}"
"""Of the emulator on this computer."""


def host_and_port(address: str, field: str) -> tuple[str, int]:
    """Return the parts of an address.

    Args:
        address: As in 192.168.1.20:47500.
        field: Name of the setting, for the error.

    Raises:
        ConfigurationError: It is not an IPv4 address and a port.
    """
    host, _, port = address.rpartition(":")
    try:
        return str(ipaddress.IPv4Address(host)), _checked_port(port)
    except ValueError as error:
        raise ConfigurationError(
            f"{field}={address!r} is not an address and a port, such as 192.168.1.20:47500"
        ) from error


def _checked_port(text: str) -> int:
    if not (text.isascii() and text.isdigit() and 1 <= int(text) <= 65535):
        raise ValueError
    return int(text)
