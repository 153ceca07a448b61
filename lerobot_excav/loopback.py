"""Addresses that reach this computer alone."""

import ipaddress


def is_loopback(host: str) -> bool:
    """Tell whether a name or an address, IPv4 or IPv6, reaches this computer alone."""
    return host == "localhost" or (is_address(host) and ipaddress.ip_address(host).is_loopback)


def is_address(host: str) -> bool:
    """Tell whether this is an address, IPv4 or IPv6, and no name."""
    try:
        ipaddress.ip_address(host)
    except ValueError:
        return False
    return True
