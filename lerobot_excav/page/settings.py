"""What a person may set of the page, whoever serves it."""

from dataclasses import dataclass

from lerobot_excav.page.access import Access, free_port
from lerobot_excav.setting import setting


@dataclass(kw_only=True)
class PageSettings:
    """Where the page is served, and how large its pictures are."""

    host: str = setting(
        "Address to listen at; another than 127.0.0.1 lets other machines in, which need the token too",
        default="127.0.0.1",
    )
    port: int = setting("Port of the page; 0 takes a free one", default=8750, low=0, high=65535)
    height: int = setting("Height of the live pictures [px]", default=480, low=96, high=1440)
    width: int = setting("Width of the live pictures [px]", default=640, low=128, high=1920)

    def access(self) -> Access:
        """Return where the page is served now, with a new token.

        Raises:
            DeviceError: A free port was asked for, and the address is not of this machine.
        """
        return Access(host=self.host, port=self.port or free_port(self.host))
