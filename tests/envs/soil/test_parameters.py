import dataclasses
import math

import pytest

from lerobot_excav.envs.soil.parameters import ORIGINS, PRESETS, SoilParameters
from lerobot_excav.errors import ConfigurationError


def test_every_number_names_its_unit_source_and_kind():
    assert set(ORIGINS) == {field.name for field in dataclasses.fields(SoilParameters)}
    assert {p.kind for p in ORIGINS.values()} <= {"datasheet", "paper", "derived", "tuned", "guess"}


def test_sand_is_the_published_one_and_a_parcel_of_it_weighs_900_g():
    sand = PRESETS["sand"]
    assert (sand.density_kg_m3, sand.cohesion_pa, sand.swell) == (1474.0, 0.0, 1.0)
    assert math.degrees(sand.friction_angle_rad) == pytest.approx(39.0, abs=0.01)
    assert sand.parcel_mass_kg(0.045) == pytest.approx(0.91, abs=0.01)


def test_packed_parcels_have_the_bulk_density_of_loosened_soil():
    dirt, radius = PRESETS["dirt"], 0.05
    bulk_m3 = 4.0 / 3.0 * math.pi * radius**3 / dirt.parcel_solid_fraction
    assert dirt.parcel_mass_kg(radius) / bulk_m3 == pytest.approx(dirt.density_kg_m3 / dirt.swell)


def test_presets_differ_from_each_other_and_can_be_keys():
    assert len(set(PRESETS.values())) == len(PRESETS) == 4
    assert {PRESETS["sand"]: 1}[dataclasses.replace(PRESETS["sand"])] == 1


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [("swell", 0.5, "1.0 to 2.0")]
    + [
        (f"{partner}_{kind}_scale", value, "0.0 to 10.0")
        for partner in ("parcel", "ground")
        for kind in ("sliding", "rolling")
        for value in (-0.1, math.nan, 10.1)
    ],
)
def test_a_value_out_of_range_is_named(name, value, allowed):
    with pytest.raises(ConfigurationError, match=f"{name}=.* is out of range; allowed: {allowed}"):
        dataclasses.replace(PRESETS["sand"], **{name: value})
