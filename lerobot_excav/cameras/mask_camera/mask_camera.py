"""The mask camera itself."""

import logging
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, override

import numpy as np
from lerobot.cameras import Camera
from numpy.typing import NDArray

from lerobot_excav.cameras.mask_camera.calibration import read_calibration
from lerobot_excav.cameras.mask_camera.config_mask_camera import MaskCameraConfig
from lerobot_excav.cameras.mask_camera.registered_depth import registered_depth_m
from lerobot_excav.cameras.shared_camera.shared_camera import SharedCamera
from lerobot_excav.envs.masks.command import Command
from lerobot_excav.envs.masks.picture_view import PictureView
from lerobot_excav.envs.masks.snapped import SnappedMasks
from lerobot_excav.envs.masks.source import MaskMissingError, MaskSource, make_mask_source, reads_text
from lerobot_excav.envs.tasks.scoop.pile_view import PileView
from lerobot_excav.errors import ConfigurationError, DeviceError

logger = logging.getLogger(__name__)

KEY = "live"
"""By which a file of masks names what this camera sees."""


class _Told(NamedTuple):
    """What a mask camera was told."""

    words: str | None
    options: str | None


class MaskCamera(Camera):  # type: ignore[misc]  # LeRobot's classes are untyped here
    """Delivers one mask until its command changes: it is made of the picture that the shared camera shows then.

    What counts as the command are the words and the file of options. The first mask is made of the first picture, which
    may take a while; after that a read costs nothing.
    """

    def __init__(self, config: MaskCameraConfig) -> None:
        super().__init__(config)
        self.config = config
        self._calibration = None if config.calibration is None else read_calibration(config.calibration)
        self._is_connected = False
        self._made_for: _Told | None = None
        self._source: tuple[_Told, MaskSource] | None = None
        self._number = 0
        self._mask: NDArray[np.uint8] | None = None

    @property
    def is_connected(self) -> bool:
        """Whether masks are delivered."""
        return self._is_connected

    @staticmethod
    def find_cameras() -> list[dict[str, Any]]:
        """Return none: this is no device."""
        return []

    @override
    def connect(self, warmup: bool = True) -> None:
        """Make ready; the shared camera may be connected later."""
        self._is_connected, self._mask = True, None

    @override
    def disconnect(self) -> None:
        """Forget the mask."""
        self._is_connected, self._mask = False, None

    @override
    def read(self) -> NDArray[np.uint8]:
        """Return the mask, (H, W, 3) uint8 of {0, 255}.

        Raises:
            DeviceError: The camera or the shared one is not connected, or depth is needed and was not measured.
            MaskMissingError: The source finds nothing, so that a policy would act without a target.
            ConfigurationError: The file of the command or of the options cannot be read, or the shared camera has
                another size.
        """
        if not self._is_connected:
            raise DeviceError(f"the mask camera of {self.config.of!r} is not connected; call connect() first")
        told = self._read_told()
        if self._mask is None or told != self._made_for:
            self._mask = self._make(told)
            self._made_for = told
        return self._mask.copy()

    @override
    def async_read(self, timeout_ms: float = 200.0) -> NDArray[np.uint8]:
        """Return the mask, as `read`."""
        return self.read()

    @override
    def read_latest(self, max_age_ms: int = 500) -> NDArray[np.uint8]:
        """Return the mask, as `read`."""
        return self.read()

    def _read_told(self) -> _Told:
        config = self.config
        words = config.text if config.command is None else _read("command", config.command).strip()
        return _Told(words, None if config.options is None else _read("options", Path(config.options)))

    def _make(self, told: _Told) -> NDArray[np.uint8]:
        config = self.config
        shared = SharedCamera.connected.get(config.of)
        if shared is None:
            raise DeviceError(
                f"no shared camera {config.of!r} is connected; give the robot one: {{type: shared, name: {config.of}, "
                "camera: ...}"
            )
        # Depth is of now, so the picture has to be as well.
        picture = shared.last_picture() if self._calibration is None else shared.async_read()
        if picture.shape[:2] != (config.height, config.width):
            raise ConfigurationError(
                f"the shared camera {config.of!r} gives {picture.shape[:2]}, the mask camera was set up for "
                f"{(config.height, config.width)} (height, width); give both the same size"
            )
        view = self._view(shared, picture, told.words or "")
        mask = self._source_of(told).mask(view, Command(target_id=0, region=None))
        if mask is None or not mask.pixels.any():
            sought = f" for {told.words or config.options!r}" * bool(told.words or config.options)
            raise MaskMissingError(
                f"source={config.source!r} of the mask camera finds nothing in the picture of {config.of!r}{sought}, "
                "so a policy had no target; say it otherwise, or move the camera"
            )
        if isinstance(view, PileView):
            view.require_free(mask.pixels)
        if mask.parameters:
            logger.info("mask of %r by %s: %s", config.of, mask.source, dict(mask.parameters))
        return mask.img

    def _source_of(self, told: _Told) -> MaskSource:
        """Return the source for what was told; the same one for the same words, whose weights are loaded then."""
        config = self.config
        words = told.words if config.command is None or reads_text(config.source) else None  # the file only says when
        heard = told._replace(words=words)
        if self._source is None or self._source[0] != heard:
            source = make_mask_source(config.source, options=config.options, text=words)
            self._source = heard, SnappedMasks(source) if config.snap else source
        return self._source[1]

    def _view(self, shared: SharedCamera, picture: NDArray[np.uint8], words: str) -> PictureView:
        """Return what the source may look at."""
        self._number += 1
        if self._calibration is None:
            return PictureView(picture, key=KEY, words=words, number=self._number)
        camera = self._calibration.camera(*picture.shape[:2])
        depth = shared.read_latest_depth()
        depth_m = registered_depth_m(depth, picture, camera=shared.name, unit_m=self._calibration.depth_unit_m)
        kind = PictureView if self.config.targets == "objects" else partial(PileView, zones=self.config.zones)
        return kind(picture, key=KEY, words=words, number=self._number, depth_m=depth_m, camera=camera)


def _read(field: str, path: Path) -> str:
    """Return the text of a file that says what to look for.

    Raises:
        ConfigurationError: It cannot be read.
    """
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigurationError(
            f"{field}={path} of the mask camera cannot be read ({error}); write the target into it"
        ) from error
