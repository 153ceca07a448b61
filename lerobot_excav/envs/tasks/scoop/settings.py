"""The settings of the excavator's tasks."""

from dataclasses import dataclass, replace
from typing import ClassVar

import lerobot_excav.envs.tasks.planner.vlm_source  # noqa: F401 - makes the source known
from lerobot_excav.envs.soil.fidelity import FIDELITIES
from lerobot_excav.envs.soil.parameters import PRESETS, SoilParameters
from lerobot_excav.envs.tasks.planner.zones import NO_ZONES, Zone, parsed_zones, zone_text
from lerobot_excav.envs.tasks.retarget import RetargetSettings
from lerobot_excav.envs.tasks.scoop.pile import PILES
from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.errors import require
from lerobot_excav.setting import setting, with_default

DENSITIES = {"light": 0.8, "usual": 1.0, "heavy": 1.2}
"""Factor on the density of the soil (kind: design), which moist or packed sand differs by."""

BETWEEN_CYCLES = ("obey", "stand")

CYCLE_DURATION_S = 20.0
"""Time limit of a single cycle unless another is asked for [s] (kind: paper)."""


@dataclass(kw_only=True)
class ExcavatorSettings(RetargetSettings):
    """What a user may set about the excavator; see `TaskSettings`."""

    ENV_TYPE: ClassVar[str] = "excavator"
    DURATION_S: ClassVar[float] = CYCLE_DURATION_S

    task: str = setting(
        "Task: Scoop-v0, a single cycle, or Clear-v0, a whole pile",
        default="Scoop-v0",
        is_column=True,
        changes_start=True,
    )
    fps: int = with_default(TaskSettings, "fps", 10)
    soil: str = setting(
        "Soil preset", default="sand", choices=tuple(PRESETS), also=SoilParameters, is_column=True, changes_start=True
    )
    density: str = setting(
        "Density of the soil: as the preset has it, or 20 % less or more; the same piles are lighter or heavier",
        default="usual",
        choices=tuple(DENSITIES),
        is_column=True,
        changes_start=True,
    )
    pile: str = setting(
        "Shape of the pile: two to four heaps, as in all trained policies, two heaps that have met, or a ridge",
        default="heaps",
        choices=tuple(PILES),
        is_column=True,
        changes_start=True,
    )
    fidelity: str = setting(
        "Numerical effort of the soil", default="standard", choices=tuple(FIDELITIES), is_column=True
    )
    keep_out: str = setting(
        "Zones of the ground in which Clear-v0 must not dig: of each the least x and y and the greatest x and y [m], "
        "such as -0.5,-3,1,-1.5; several are parted by a semicolon, and none is none",
        default=NO_ZONES,
        is_column=True,
        changes_start=True,
    )

    between_cycles: str = setting(
        "What the machine does in Clear-v0 from a dump until the next command: obey its sticks, or stand, whatever "
        "they say, as it does where demonstrations of Scoop-v0 end",
        default="obey",
        choices=BETWEEN_CYCLES,
        is_column=True,
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        require(
            not self.mask_snap,
            f"{self.PREFIX}mask_snap=True has no use on the ground, where every place can be meant; leave it out",
        )
        zones = parsed_zones(f"{self.PREFIX}keep_out", self.keep_out)
        self.keep_out = zone_text(zones)
        require(
            not zones or self.task != "Scoop-v0",
            f"{self.PREFIX}keep_out={self.keep_out!r} has no effect with {self.PREFIX}task='Scoop-v0', whose regions "
            "belong to the scene; leave it out, or give --env.task=Clear-v0",
        )
        require(
            self.between_cycles == "obey" or self.task != "Scoop-v0",
            f"{self.PREFIX}between_cycles={self.between_cycles!r} has no effect with {self.PREFIX}task='Scoop-v0', a "
            "single cycle; leave it out, or give --env.task=Clear-v0",
        )
        require(
            self.retarget_frame is None or self.task == "Scoop-v0",
            f"{self.PREFIX}retarget_frame={self.retarget_frame} has no effect with {self.PREFIX}task={self.task!r}, "
            "whose planner gives the commands; leave it out, or give --env.task=Scoop-v0",
        )

    @property
    def zones(self) -> tuple[Zone, ...]:
        """The keep-out zones."""
        return parsed_zones("keep_out", self.keep_out)

    @property
    def dug_soil(self) -> str | SoilParameters:
        """The soil as it lies there: the preset or the parameters given, at the density asked for."""
        return soil_at_density(self.soil, self.density)

    @property
    def soil_name(self) -> str:
        """Name of the soil preset; `custom` for parameters of one's own."""
        return "custom" if isinstance(self.soil, SoilParameters) else self.soil


def soil_at_density(soil: str | SoilParameters, density: str) -> str | SoilParameters:
    """Return a soil, a preset or parameters, at one of the `DENSITIES`."""
    factor = DENSITIES[density]
    if factor == 1.0:
        return soil
    parameters = soil if isinstance(soil, SoilParameters) else PRESETS[soil]
    return replace(parameters, density_kg_m3=factor * parameters.density_kg_m3)
