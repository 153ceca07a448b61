import pytest

from lerobot_excav.envs.tasks.planner.zones import parsed_zones, zone_text
from lerobot_excav.envs.tasks.scoop.settings import ExcavatorSettings
from lerobot_excav.errors import ConfigurationError


@pytest.mark.parametrize("text", ["0,0,1,1;2,2,3,3.5", " 0.0, 0,1.00,1 ; 2,2,3,3.5", "2,2,3,3.5; 0,0,1,1; -0,0,1,1"])
def test_zones_have_one_spelling_in_files(text):
    assert ExcavatorSettings(task="Clear-v0", keep_out=text).keep_out == "0,0,1,1; 2,2,3,3.5"


def test_a_spelling_reads_back():
    zones = parsed_zones("keep_out", "-0.123,-3,1,-1.5")
    assert parsed_zones("keep_out", zone_text(zones)) == zones
    assert zone_text(()) == "none"


@pytest.mark.parametrize("text", ["3,0,4,1", "0,-9,1,-3", "-5,0,-3.5,1"])
def test_a_zone_beside_the_dig_area_is_an_error_and_not_without_effect(text):
    with pytest.raises(ConfigurationError, match=r"keep_out=.* lies beside the dig area .* -3 to 3 m"):
        parsed_zones("keep_out", text)
