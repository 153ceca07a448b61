import pytest

from lerobot_excav.envs.masks.oracle import OracleSource
from lerobot_excav.envs.masks.source import make_mask_source, mask_source_names, register_mask_source
from lerobot_excav.errors import ConfigurationError


def test_the_oracle_is_known():
    assert "oracle" in mask_source_names()
    assert isinstance(make_mask_source("oracle"), OracleSource)


def test_an_unknown_source_is_named_with_the_known_ones():
    with pytest.raises(ConfigurationError, match=r"mask_source='crystal ball' is not known; allowed: .*'oracle'"):
        make_mask_source("crystal ball")


def test_a_name_belongs_to_one_source():
    register_mask_source("oracle", OracleSource)
    with pytest.raises(ConfigurationError, match="'oracle' exists"):
        register_mask_source("oracle", object)
