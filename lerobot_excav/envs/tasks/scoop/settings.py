"""The settings of the excavator's tasks."""

from dataclasses import dataclass
from typing import ClassVar

from lerobot_excav.envs.soil.fidelity import FIDELITIES
from lerobot_excav.envs.soil.parameters import PRESETS, SoilParameters
from lerobot_excav.envs.tasks.settings import TaskSettings
from lerobot_excav.setting import setting, with_default


@dataclass(kw_only=True)
class ExcavatorSettings(TaskSettings):
    """What a user may set about the excavator; see `TaskSettings`."""

    ENV_TYPE: ClassVar[str] = "excavator"

    task: str = with_default(TaskSettings, "task", "Scoop-v0")
    fps: int = with_default(TaskSettings, "fps", 10)
    soil: str = setting(
        "Soil preset", default="sand", choices=tuple(PRESETS), also=SoilParameters, is_column=True, changes_start=True
    )
    fidelity: str = setting(
        "Numerical effort of the soil", default="standard", choices=tuple(FIDELITIES), is_column=True
    )

    @property
    def soil_name(self) -> str:
        """Name of the soil preset; `custom` for parameters of one's own."""
        return "custom" if isinstance(self.soil, SoilParameters) else self.soil
