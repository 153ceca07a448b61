"""Deformable soil: a height field, a bucket that cuts and spills, parcels in the air, a target box.

Independent of any simulator: poses go in; heights, parcels and wrenches come out.

- `Soil`: the world of soil; `Tool` and `ToolGeometry` describe the bucket, `Reaction` is the answer to it.
- `Container`: the target box.
- `SoilParameters`, `PRESETS`, `FIDELITIES`: what the soil is, and how finely it is computed.
- `relax`: lets a height field avalanche to rest; scenes use it.

Names are loaded when they are asked for: settings name the presets, and must not wait for the compiler.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lerobot_excav.envs.soil.container import Container
    from lerobot_excav.envs.soil.fidelity import FIDELITIES, Fidelity
    from lerobot_excav.envs.soil.parameters import PRESETS, SoilParameters
    from lerobot_excav.envs.soil.relaxation import relax
    from lerobot_excav.envs.soil.soil import Soil
    from lerobot_excav.envs.soil.tool import Reaction, Tool, ToolGeometry

__all__ = [
    "FIDELITIES",
    "PRESETS",
    "Container",
    "Fidelity",
    "Reaction",
    "Soil",
    "SoilParameters",
    "Tool",
    "ToolGeometry",
    "relax",
]

_MODULES = {
    "container": ("Container",),
    "fidelity": ("FIDELITIES", "Fidelity"),
    "parameters": ("PRESETS", "SoilParameters"),
    "relaxation": ("relax",),
    "soil": ("Soil",),
    "tool": ("Reaction", "Tool", "ToolGeometry"),
}


def __getattr__(name: str) -> Any:
    for module, names in _MODULES.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
