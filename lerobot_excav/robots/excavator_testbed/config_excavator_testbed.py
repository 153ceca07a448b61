"""Configuration of `--robot.type=excavator_testbed`."""

from dataclasses import dataclass
from pathlib import Path

from lerobot.cameras import CameraConfig
from lerobot.robots import RobotConfig

from lerobot_excav.cameras.mask_camera.config_mask_camera import MaskCameraConfig
from lerobot_excav.errors import require, shown
from lerobot_excav.loopback import is_loopback
from lerobot_excav.setting import check_settings, setting
from lerobot_excav.testbed.address import USUAL_ADDRESS, host_and_port

DEAD_MEN = ("always", "gamepad")


@RobotConfig.register_subclass("excavator_testbed")
@dataclass(kw_only=True)
class ExcavatorTestbedConfig(RobotConfig):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Set up a machine behind a wire from LeRobot's command line.

    Raises:
        ConfigurationError: A field has a value that cannot be used.
    """

    address: str = setting("Address and port of the machine's datagrams", default=USUAL_ADDRESS)
    cameras: dict[str, CameraConfig] = setting(
        "Cameras of LeRobot by the names that policies know: main, cab and target_mask", default_factory=dict
    )
    dead_man: str = setting(
        "Who lets the machine move: gamepad, a button that a person holds, or always, for an emulator on this computer",
        default="always",
        choices=DEAD_MEN,
    )
    dead_man_device: int = setting("Position of that device among the connected ones", default=0, low=0, high=255)
    dead_man_button: int = setting("Number of the button", default=4, low=0, high=255)
    speed_limit: float = setting(
        "Greatest command that is sent, as a share of full speed; the machine has a limit of its own",
        default=1.0,
        above=0.0,
        high=1.0,
    )
    release_stop: bool = setting(
        "Whether connecting releases an emergency stop that is latched; look at the machine first", default=False
    )
    ready_timeout_s: float = setting(
        "How long to wait until the machine is ready: its soak of 30 s, and a person who lets go of everything [s]",
        default=120.0,
        above=0.0,
        high=3600.0,
    )
    alignment_log: Path | None = setting(
        "JSON Lines file of how old pictures and state were in every frame; left out: "
        "outputs/excavator_testbed_alignment/<date>_<time>.jsonl",
        default=None,
    )

    def __post_init__(self) -> None:
        require(
            isinstance(self.cameras, dict) and all(isinstance(each, CameraConfig) for each in self.cameras.values()),
            f"robot.cameras={shown(self.cameras)} is not possible; give cameras by name, or leave it out",
        )
        super().__post_init__()
        check_settings(self, "robot.")
        blind = [name for name, camera in self.cameras.items() if not getattr(camera, "use_rgb", True)]
        require(
            not blind, f"use_rgb=false of robot.cameras.{', '.join(blind)} is not possible: policies look at pictures"
        )
        host, _ = self.host_and_port
        require(
            self.dead_man != "always" or is_loopback(host),
            f"robot.address={self.address!r} with robot.dead_man='always' lets the machine at {host} move while nobody "
            "watches; that is for an emulator on this computer (127.0.0.1). Give robot.dead_man=gamepad",
        )

    @property
    def has_mask(self) -> bool:
        """Whether one of the cameras shows a target mask, by its name or by its type."""
        return "target_mask" in self.cameras or any(
            isinstance(each, MaskCameraConfig) for each in self.cameras.values()
        )

    @property
    def has_depth(self) -> bool:
        """Whether one of the cameras measures depth."""
        return any(getattr(each, "use_depth", False) for each in self.cameras.values())

    @property
    def host_and_port(self) -> tuple[str, int]:
        """Address of the machine.

        Raises:
            ConfigurationError: It is not an IPv4 address and a port.
        """
        return host_and_port(self.address, "robot.address")
