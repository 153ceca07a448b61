"""Stand in for a real excavator: a simulated machine that speaks the test bed's protocol in real time.

It listens for datagrams and offers its cameras, main, cab and target_mask, over the network; the robot type
excavator_testbed drives it as it would drive the real one. What comes of every cycle is printed and, with --metrics,
written down; then the next target of the scene is shown. Ctrl-C ends it.

Examples:
  lerobot-excav testbed-emulator
      a machine at 127.0.0.1:47500, its cameras at port 47501
  lerobot-excav testbed-emulator --delay_ms=40 --loss=0.05 --metrics=outputs/testbed.jsonl
      ... behind a bad wire
  lerobot-excav testbed-emulator --calibration=outputs/main.toml
      ... with a depth camera, at which mask sources may look
"""

import signal
import threading
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lerobot_excav.envs.configs.metrics_log import json_line
from lerobot_excav.envs.tasks.registry import task_of_settings, task_settings
from lerobot_excav.envs.tasks.settings import LAST_SCENE
from lerobot_excav.errors import require
from lerobot_excav.scripts.arguments import Arguments, EnvironmentChoice
from lerobot_excav.setting import setting
from lerobot_excav.testbed.address import USUAL_PORT
from lerobot_excav.testbed.protocol import DIVIDING_RATES, RATE_HZ
from lerobot_excav.testbed.safety import SOAK_S
from lerobot_excav.whole_file import write_whole


@dataclass(kw_only=True)
class TestbedEmulatorArguments(Arguments):
    """Arguments of `lerobot-excav testbed-emulator`."""

    env: EnvironmentChoice = field(default_factory=EnvironmentChoice.default)
    """Worksite of the machine; the excavator's single cycle by default."""
    host: str = setting("Address to listen at; only this computer reaches 127.0.0.1", default="127.0.0.1")
    port: int = setting("Port of the datagrams; 0 takes a free one", default=USUAL_PORT, low=0, high=65535)
    picture_port: int = setting("Port of the pictures; 0 takes a free one", default=47501, low=0, high=65535)
    first_scene: int = setting("Number of the first scene", default=0, low=0, high=LAST_SCENE)
    pictures_hz: int = setting("Pictures a second of each camera", default=10, choices=DIVIDING_RATES)
    soak_s: float = setting(
        "How long zero commands are watched after switching on [s]", default=SOAK_S, low=0.0, high=3600.0
    )
    speed_limit: float = setting(
        "Greatest command that is carried out, as a share of full speed", default=1.0, above=0.0, high=1.0
    )
    valve_lag_s: float = setting("Time constant of the valves [s]", default=0.1, low=0.0, high=5.0)
    valve_dead_zone: float = setting("Command below which nothing flows", default=0.03, low=0.0, below=1.0)
    joint_noise_rad: float = setting("Standard deviation of the joint sensors [rad]", default=0.001, low=0.0, high=1.0)
    loss: float = setting("Share of the datagrams that are lost, each way", default=0.0, low=0.0, high=1.0)
    delay_ms: float = setting("How long every datagram takes, each way [ms]", default=0.0, low=0.0, high=10_000.0)
    jitter_ms: float = setting("Mean of what comes on top of that [ms]", default=0.0, low=0.0, high=10_000.0)
    duplicates: float = setting("Share of the datagrams that come twice", default=0.0, low=0.0, high=1.0)
    seed: int = setting("Seed of noise and faults", default=0, low=0, high=2**63 - 1)
    metrics: Path | None = setting("JSON Lines file of what came of every cycle", default=None)
    calibration: Path | None = setting(
        "Offer the depth of main as well, and write to this TOML file where main stands, for a mask camera",
        default=None,
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        spec = task_of_settings(self.env)
        require(
            spec.env_type == "excavator",
            f"--env.type={spec.env_type} is no excavator; leave it out, or give --env.type=excavator",
        )
        for name in ("fps", "episode_length", "retarget_frame", "target_overlay"):
            value, usual = getattr(self.env, name), getattr(type(self.env), name)
            require(
                value == usual,
                f"--env.{name}={value} has no place here: the machine ticks at {RATE_HZ} Hz, and shows what it is told "
                "by target_mask alone; leave it out",
            )


def run(arguments: TestbedEmulatorArguments) -> int:
    """Serve until it is interrupted."""
    from lerobot_excav.cameras.mask_camera.calibration import calibration_text
    from lerobot_excav.testbed.emulated_site import EmulatedSite
    from lerobot_excav.testbed.emulator import EmulatedMachine
    from lerobot_excav.testbed.faulty_wire import WireFaults
    from lerobot_excav.testbed.valves import Valves

    is_over = threading.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: is_over.set())
    names = ("loss", "delay_ms", "jitter_ms", "duplicates")
    machine = EmulatedMachine(
        valves=Valves(lag_s=arguments.valve_lag_s, dead_zone=arguments.valve_dead_zone),
        wire=WireFaults(**{name: getattr(arguments, name) for name in names}),
        **{
            name: getattr(arguments, name)
            for name in ("joint_noise_rad", "speed_limit", "soak_s", "pictures_hz", "seed")
        },
    )
    site = EmulatedSite(
        task_settings(arguments.env),
        machine,
        first_scene=arguments.first_scene,
        host=arguments.host,
        ports=(arguments.port, arguments.picture_port),
        has_depth=arguments.calibration is not None,
        on_over=lambda metrics: _tell(metrics, arguments.metrics),
    )
    emulator = site.emulator
    print(f"the machine: {emulator.address[0]}:{emulator.address[1]}", flush=True)
    print(f"its cameras: {emulator.picture_address[0]}:{emulator.picture_address[1]}", flush=True)
    try:
        if arguments.calibration is not None:
            _write_calibration(arguments.calibration, calibration_text(site.camera))
        emulator.run(is_over.is_set)
    finally:
        site.close()
    print(f"{emulator.late_ticks} ticks took longer than they simulate")
    return 0


def _write_calibration(path: Path, text: str) -> None:
    """Write a calibration, unless somebody else's is there."""
    is_other = path.exists() and path.read_text(encoding="utf-8") != text
    require(not is_other, f"--calibration={path} holds another calibration; give the name of a new file")
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, text)


def _tell(metrics: dict[str, Any], path: Path | None) -> None:
    words = "success" if metrics["is_success"] else "no success"
    print(f"scene {metrics['scene_id']}, target {metrics['target_id']}: {words}", flush=True)
    if path is not None:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a", encoding="utf-8") as file:
            file.write(json_line(metrics))


ARGUMENTS = TestbedEmulatorArguments
