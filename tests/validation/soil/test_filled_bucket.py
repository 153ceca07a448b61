import pytest

from bench.soil import BUCKET
from lerobot_excav.envs.soil.bucket import heaped_volume_m3
from lerobot_excav.envs.soil.parameters import PRESETS
from validation.soil.filled_bucket import heap_kg


@pytest.mark.parametrize("preset", PRESETS)
def test_the_heap_that_is_integrated_is_the_one_of_the_formula(preset):
    soil = PRESETS[preset]
    volume = heaped_volume_m3(BUCKET, soil.slope_tan)
    assert heap_kg(preset) == pytest.approx(volume * soil.density_kg_m3 / soil.swell, rel=1e-3)
