"""A trained network, as a function from picture and click to mask."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file

from lerobot_excav.envs.masks.click.network import PICTURE_SIZE, ClickNetwork
from lerobot_excav.envs.masks.click.window import brought, put_back, window
from lerobot_excav.errors import ConfigurationError, require

BUILT_IN = Path(__file__).with_name("click_segmenter.safetensors")
"""The network that comes with the package, trained on scenes of both machines."""


class ClickSegmenter:
    """Marks what somebody has clicked on.

    Args:
        network: A trained network.
        facts: What is known of its training, in words.
    """

    def __init__(self, network: ClickNetwork, facts: Mapping[str, str]) -> None:
        self._network, self.facts = network.eval(), dict(facts)

    @classmethod
    def load(cls, path: Path) -> "ClickSegmenter":
        """Read a network that `save` has written.

        Raises:
            ConfigurationError: The file is not there, or is none of ours.
        """
        network = ClickNetwork()
        try:
            with safe_open(path, framework="pt") as file:
                facts = file.metadata() or {}
                weights = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - no mapping
            network.load_state_dict({name: weight.float() for name, weight in weights.items()})
        except (OSError, SafetensorError, RuntimeError) as error:
            raise ConfigurationError(
                f"model={path} holds no click segmenter ({' '.join(str(error).split())[:200]}); make one with "
                "`lerobot-excav segmenter --out=FILE`, or leave model out for the one that comes with the package"
            ) from error
        return cls(network, facts)

    def save(self, path: Path) -> None:
        """Write the network, in half precision, and what is known of its training."""
        weights = {name: value.half().contiguous() for name, value in self._network.state_dict().items()}
        save_file(weights, path, metadata=self.facts)

    def pixels(self, picture: NDArray[np.uint8], row: float, column: float) -> NDArray[np.bool_]:
        """Return what a click marks in a picture (H, W, 3), (H', W') bool of `PICTURE_SIZE`.

        Args:
            picture: Any size; it is brought to `PICTURE_SIZE`.
            row: Where was clicked, as a share of the height from above, [0, 1].
            column: As a share of the width from the left.

        Raises:
            ConfigurationError: The click lies beside the picture.
        """
        require(
            0.0 <= row <= 1.0 and 0.0 <= column <= 1.0,
            f"the click at row {row:.3f}, column {column:.3f} lies beside the picture; give shares from 0 to 1",
        )
        at = [min(int(share * length), length - 1) for share, length in zip((row, column), PICTURE_SIZE, strict=True)]
        seen = torch.from_numpy(window(brought(picture), *at))[None]
        with torch.inference_mode():
            logits = self._network(seen)[0, 0].numpy()
        return put_back(logits > 0.0, *at)
