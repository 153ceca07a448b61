"""Weights of the models that make masks: from a folder, or by name from the Hugging Face Hub; offline by default."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel, ConfigDict, Field

from lerobot_excav.errors import ConfigurationError, require

# Commits that `main` of the Hub had in 2026, so that a result can be repeated though a name stays and its files change.
PINNED = {
    "IDEA-Research/grounding-dino-tiny": "a2bb814dd30d776dcf7e30523b00659f4f141c71",
    "facebook/sam2.1-hiera-tiny": "de431c4043854a71d8101e17995dfe596bf101a5",
    "Qwen/Qwen2.5-VL-7B-Instruct": "cc594898137f460bfe9f0759e9844b3ce807cfb5",
}


class ModelName(BaseModel):
    """Which weights to take.

    Attributes:
        name: Folder of the weights, or their name on the Hub.
        revision: Commit of the Hub, that of `PINNED` if left out, else `main`; a folder has none.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str
    revision: str | None = Field(default_factory=lambda given: PINNED.get(given.get("name")))

    @property
    def words(self) -> str:
        """How provenance names them: a folder by its last part, for its place is nobody's business."""
        return Path(self.name).name if Path(self.name).is_dir() else f"{self.name}@{self.revision or 'main'}"


class Placement(NamedTuple):
    """Where a model runs, and whether its weights may be fetched from the Hub."""

    download: bool
    device: str


def load_model(kind: Callable[..., Any], model: ModelName, placement: Placement, **options: Any) -> Any:
    """Load a model, ready to run; see `load`.

    Raises:
        ConfigurationError: As `load`, or the weights are of another kind of model, or there is no such device.
    """
    loaded, report = load(kind, model, download=placement.download, output_loading_info=True, **options)
    lacking = sorted(report["missing_keys"])
    require(
        not lacking,
        f"the weights {model.name!r} are of another model: they lack {len(lacking)} parts, such as {lacking[:1]}; "
        "give weights of the kind that this option takes",
    )
    try:
        return loaded.to(placement.device).eval()
    except (RuntimeError, AssertionError) as error:
        raise ConfigurationError(
            f"device={placement.device!r} is not possible: {' '.join(str(error).split())[:200]}; give cpu, or cuda "
            "where there is one"
        ) from error


def load(kind: Callable[..., Any], model: ModelName, *, download: bool, **options: Any) -> Any:
    """Load a model or its processor, `kind` being its class's `from_pretrained`.

    Args:
        kind: Loads it.
        model: Which.
        download: Whether it may be fetched from the Hub.
        options: Further arguments of `kind`.

    Raises:
        ConfigurationError: The weights are not here and may not be fetched, or are damaged.
    """
    revision = {} if Path(model.name).is_dir() else {"revision": model.revision}
    at = f" at commit {model.revision}" if revision.get("revision") else ""
    try:
        return kind(model.name, local_files_only=not download, **revision, **options)
    except Exception as error:  # transformers and safetensors raise a dozen kinds over files that are damaged
        where = os.environ.get("HF_HOME", "~/.cache/huggingface")
        raise ConfigurationError(
            f"the weights {model.name!r}{at} cannot be loaded: {' '.join(str(error).split())[:300]}. Give a folder "
            f"that holds them, or set download = true in mask_options; what was fetched before lies in {where}"
        ) from error


def require_transformers() -> None:
    """Check that the library of the models is there.

    Raises:
        ConfigurationError: It is not.
    """
    try:
        import transformers  # noqa: F401
    except ImportError as missing:
        raise ConfigurationError(
            "masks from words need the library transformers; install it with: pip install 'lerobot_env_excav[masks]'"
        ) from missing
