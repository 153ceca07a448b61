"""Who may open the page: whoever knows the token, from this machine unless other hosts were asked for."""

import hmac
import secrets
import socket
from collections.abc import Mapping
from dataclasses import dataclass, field
from urllib.parse import urlsplit

from lerobot_excav.errors import DeviceError
from lerobot_excav.loopback import is_address, is_loopback

LOOPBACK = ("127.0.0.1", "localhost", "[::1]")


@dataclass(frozen=True, kw_only=True)
class Access:
    """What a request has to show.

    Attributes:
        host: Address that the server listens at; one of loopback lets no other machine in.
        port: Its port.
        token: What the address of the page has to hold.
    """

    host: str
    port: int
    token: str = field(default_factory=lambda: secrets.token_urlsafe(16))

    @property
    def cookie(self) -> str:
        """Name of the cookie that holds the token once the page was opened with it; browsers share cookies of ports."""
        return f"excav_token_{self.port}"

    @property
    def address(self) -> str:
        """Address of the page, with the token."""
        host = outward_address() if self.host in ("0.0.0.0", "::") else self.host
        return f"http://{f'[{host}]' if ':' in host else host}:{self.port}/?token={self.token}"

    def knows_token(self, query: Mapping[str, str], cookies: Mapping[str, str]) -> bool:
        """Tell whether a request knows the token, from the address or from an earlier visit."""
        given = query.get("token") or cookies.get(self.cookie, "")
        return hmac.compare_digest(given.encode(), self.token.encode())

    def is_for_us(self, headers: Mapping[str, str]) -> bool:
        """Tell whether a request was meant for this server and comes from its own page.

        A page of someone else may lead a browser here by a name of its own (DNS rebinding), or talk to this server over
        a socket, which browsers allow: names that are not ours, and origins other than the page itself, are refused.
        """
        host = headers.get("host", "")
        if not self._is_our_name(host):
            return False
        origin = headers.get("origin")
        return origin is None or urlsplit(origin).netloc == host

    def _is_our_name(self, host: str) -> bool:
        name, colon, port = host.rpartition(":")
        if not colon or "]" in port:  # browsers leave the port of HTTP out
            name, port = host, "80"
        if port != str(self.port):
            return False
        if name in LOOPBACK or name.strip("[]") == self.host:
            return True
        return not is_loopback(self.host) and is_address(name.strip("[]"))


def outward_address() -> str:
    """Return the address under which other machines most likely reach this one; that of loopback if none does."""
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect(("192.0.2.1", 9))  # chooses a way out; nothing is sent
            return str(probe.getsockname()[0])
    except OSError:
        return "127.0.0.1"


def free_port(host: str) -> int:
    """Return a port of an address of this machine that nobody uses now.

    Raises:
        DeviceError: The address is not of this machine.
    """
    try:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        with socket.create_server((host, 0), family=family) as server:
            return int(server.getsockname()[1])
    except OSError as error:
        raise DeviceError(f"--host={host} is no address of this machine; give another one, or leave it out") from error
