"""The robot itself: four rates over the wire, states and pictures back."""

import logging
import time
from collections.abc import Mapping
from datetime import datetime
from typing import Any, override

import numpy as np
from lerobot.cameras.utils import make_cameras_from_configs
from lerobot.robots import Robot

from lerobot_excav.envs.machines.excavator.features import ACTION_NAMES, STATE_NAMES
from lerobot_excav.errors import DeviceError
from lerobot_excav.robots.excavator_testbed.alignment import Ages, AlignmentLog
from lerobot_excav.robots.excavator_testbed.command_lapse import CommandLapse
from lerobot_excav.robots.excavator_testbed.config_excavator_testbed import ExcavatorTestbedConfig
from lerobot_excav.robots.recording_command import require_command_for_machine
from lerobot_excav.robots.recording_phases import RecordingPhases
from lerobot_excav.robots.session_log import default_path
from lerobot_excav.robots.simulated_robot import command_from_action
from lerobot_excav.testbed.dead_man import AlwaysHeld, DeadMan, GamepadButton
from lerobot_excav.testbed.host_link import Heard, HostLink
from lerobot_excav.testbed.protocol import DIVIDING_RATES, REFUSAL_WORDS, Refusal, StateFlag
from lerobot_excav.testbed.safety import STALE_S, STILL

logger = logging.getLogger(__name__)

# Until a machine is ready it has to see centred sticks, whatever a policy wants.
NOT_READY = (Refusal.EMERGENCY_STOP, Refusal.NOT_HEARD, Refusal.SOAK, Refusal.START_GATE)

FRAME_RATES = tuple(rate for rate in DIVIDING_RATES if rate * STALE_S > 1.0)
"""Frames a second that a loop may have: they divide the rate of datagrams, so that every action is sent equally often,
and a frame is shorter than a command counts."""

_WORDS_EVERY_S = 5.0


class ExcavatorTestbed(Robot):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """A machine that is driven over the network, at ten frames a second or more.

    A command counts for `STALE_S`: a loop that is slower or hangs makes the machine stand still. So does a person who
    lets go of the dead-man. Before the machine moves, and again after every loss of the link, it wants to see centred
    sticks with the dead-man let go; until then the robot sends zero, whatever the policy says.

    Attributes:
        cameras: The cameras by name.
        link: The wire.

    Raises:
        ConfigurationError: The command of LeRobot that makes it has another rate than `FRAME_RATES`, or records masks
            in lossy videos.
    """

    config_class = ExcavatorTestbedConfig
    name = "excavator_testbed"

    def __init__(self, config: ExcavatorTestbedConfig) -> None:
        super().__init__(config)
        self.config = config
        require_command_for_machine(config, rates=FRAME_RATES, has_mask=config.has_mask, has_depth=config.has_depth)
        self.cameras = make_cameras_from_configs(config.cameras)
        self.link: HostLink | None = None
        self._heard: Heard | None = None
        self._taken_us: list[int] = []  # when what was observed last was taken
        path = config.alignment_log or default_path(f"{self.name}_alignment", datetime.now())
        self._log = AlignmentLog(path)
        self._lapse = CommandLapse()
        self._phases = RecordingPhases(
            on_episode=self._log.begin, on_pause=self._log.end, on_discard=self._log.end, on_stop=self._log.end
        )

    @property
    def observation_features(self) -> dict[str, type | tuple[int, int, int]]:
        """Joint positions [rad] and velocities [rad/s] as those of the simulated machine, the cameras, and their depth.

        Depth is called `<camera>_depth`, (H, W, 1) uint16 [mm], as with LeRobot's own robots.
        """
        sizes = {name: (camera.height, camera.width, 3) for name, camera in self.cameras.items()}
        depths = {f"{name}_depth": (*sizes[name][:2], 1) for name, each in self.cameras.items() if _has_depth(each)}
        return {**dict.fromkeys(STATE_NAMES, float), **sizes, **depths}

    @property
    def action_features(self) -> dict[str, type]:
        """Rates of swing, boom, arm and bucket as fractions of full speed."""
        return dict.fromkeys(ACTION_NAMES, float)

    @property
    def is_connected(self) -> bool:
        """Whether the wire is open."""
        return self.link is not None

    @property
    def is_calibrated(self) -> bool:
        """Always: the machine's own sensors are calibrated on the machine."""
        return True

    def calibrate(self) -> None:
        """Do nothing."""

    def configure(self) -> None:
        """Do nothing: the configuration is complete when the robot is made."""

    @override
    def connect(self, calibrate: bool = True) -> None:
        """Open wire and cameras, and wait until the machine is ready.

        Raises:
            DeviceError: The machine or a camera is not there, the dead-man is missing, or it is not ready in time.
        """
        if self.link is not None:
            raise DeviceError(f"the robot {self.name} is connected already; call disconnect() first.")
        link = HostLink(self.config.host_and_port, dead_man=self._dead_man(), hold_s=STALE_S)
        try:
            self._log.start()
            link.connect()
            self.link = link
            self._wait_until_ready(link)
            for camera in self.cameras.values():
                camera.connect()
            self._heard, self._lapse = link.heard(), CommandLapse()
        except BaseException:
            self._close()
            raise
        logging.getLogger().addHandler(self._phases)

    def disconnect(self) -> None:
        """Stop the machine, and close wire and cameras.

        Raises:
            DeviceError: The robot is not connected.
        """
        self._opened()
        logging.getLogger().removeHandler(self._phases)
        self._close()
        log = self._log
        for count, words in (
            (log.late_frames, "pictures or state were too old beside the action"),
            (log.other_frames, "the machine did not do what the action says"),
        ):
            if count:
                logger.warning("in %d of %d recorded frames %s; %s says in which", count, log.frames, words, log.path)

    def get_observation(self) -> dict[str, Any]:
        """Return state and pictures as they are now.

        Raises:
            DeviceError: The robot is not connected, the machine is not heard any more, or a camera fails.
        """
        link = self._opened()
        self._heard = heard = link.heard()
        values = (*heard.state.joint_pos, *heard.state.joint_vel)
        pictures, taken_us = {}, []
        for name, camera in self.cameras.items():
            pictures[name] = camera.async_read()
            if _has_depth(camera):
                pictures[f"{name}_depth"] = camera.read_latest_depth()
            taken_us.append(_taken_us(camera, link))  # now: cameras go on meanwhile
        self._taken_us = [at_us for at_us in taken_us if at_us is not None]
        return {**dict(zip(STATE_NAMES, values, strict=True)), **pictures}

    def send_action(self, action: Mapping[str, Any]) -> dict[str, Any]:
        """Tell the machine how to move until the next action comes, `STALE_S` at most.

        Returns:
            What was sent: within the limits, and zero while the machine is not ready.

        Raises:
            DeviceError: The robot is not connected, or a command is missing or not finite.
        """
        link = self._opened()
        limit = self.config.speed_limit
        wanted = command_from_action(action, ACTION_NAMES)
        told = np.clip(wanted, -limit, limit)
        refusal = Refusal.NOT_HEARD if self._heard is None else self._heard.state.refusal
        is_ready = refusal not in NOT_READY
        link.let_go(lets_go=not is_ready and self.config.dead_man == "always")
        swing, boom, arm, bucket = map(float, told) if is_ready else STILL
        link.give((swing, boom, arm, bucket))
        if is_ready:
            self._lapse.note(time.monotonic(), 1e-6 * link.way_us)
        is_as_told = refusal is Refusal.NONE and bool((np.abs(wanted - (swing, boom, arm, bucket)) < 1e-6).all())
        self._log.note(self._ages(), refusal.name, is_as_told=is_as_told)
        return dict(zip(ACTION_NAMES, (swing, boom, arm, bucket), strict=True))

    def stop(self) -> None:
        """Stop the machine at once; it stays stopped until `release`."""
        self._opened().stop()

    def release(self) -> None:
        """Release the emergency stop; then the machine wants to see centred sticks and the dead-man let go."""
        self._opened().release()

    def _opened(self) -> HostLink:
        if self.link is None:
            raise DeviceError(f"the robot {self.name} is not connected; call connect() first.")
        return self.link

    def _dead_man(self) -> DeadMan:
        if self.config.dead_man == "always":
            return AlwaysHeld()
        return GamepadButton(self.config.dead_man_device, self.config.dead_man_button)

    def _wait_until_ready(self, link: HostLink) -> None:
        """Send zero with the dead-man let go until the machine is armed."""
        link.let_go(lets_go=self.config.dead_man == "always")
        deadline, words_s, why = time.monotonic() + self.config.ready_timeout_s, 0.0, "it is not heard"
        was_latched, has_asked = (
            True,
            False,
        )  # a stop from before may be released, if so configured; a later one may not
        while time.monotonic() < deadline:
            link.give(STILL)
            time.sleep(0.02)
            try:
                state = link.heard().state
            except DeviceError:
                continue
            if state.command_session != link.session:
                continue  # what it says to another host, or said before it heard this one
            if state.flags & StateFlag.ARMED:
                link.let_go(lets_go=False)
                return
            is_latched = bool(state.flags & StateFlag.STOP_LATCHED)
            if is_latched and not was_latched:
                raise DeviceError(
                    f"the machine at {self.config.address} was stopped while the robot waited for it. Look at it; then "
                    "begin again with --robot.release_stop=true"
                )
            if is_latched and self.config.release_stop and not has_asked:
                link.release()
                has_asked = True
            was_latched = is_latched
            why = REFUSAL_WORDS[state.refusal]
            if time.monotonic() - words_s > _WORDS_EVERY_S:
                words_s = time.monotonic()
                logger.info("waiting for the machine: %s", why)
        raise DeviceError(
            f"the machine at {self.config.address} is not ready after {self.config.ready_timeout_s:.0f} s: {why}. Let "
            "go of sticks and dead-man, give --robot.release_stop=true if its emergency stop is latched and all is "
            "well, begin again if it was stopped while the robot waited, and check address and cable"
        )

    def _ages(self) -> Ages:
        """Return how old what was observed last is now."""
        now_us = time.perf_counter_ns() // 1000
        state_us = now_us if self._heard is None else self._heard.true_us
        image_ms = (now_us - min(self._taken_us)) * 1e-3 if self._taken_us else None
        return Ages(image_ms=image_ms, state_ms=(now_us - state_us) * 1e-3)

    def _close(self) -> None:
        if self.link is not None:
            self.link.close()
        self.link = None
        for camera in self.cameras.values():
            if camera.is_connected:
                camera.disconnect()
        self._log.close()


def _has_depth(camera: Any) -> bool:
    """Tell whether a camera of LeRobot measures depth as well."""
    return bool(getattr(camera, "use_depth", False))


def _taken_us(camera: Any, link: HostLink) -> int | None:
    """Return when a camera's last picture was taken, by the host's clock [us]; else when it came; None if unknown."""
    taken_us, came_s = getattr(camera, "taken_us", None), getattr(camera, "latest_timestamp", None)
    if taken_us is not None and link.offset.is_known:
        return int(taken_us) + link.offset.offset_us
    return None if came_s is None else round(came_s * 1e6)
