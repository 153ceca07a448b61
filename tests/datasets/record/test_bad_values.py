"""Whatever a setting is given: it is taken because it is declared so, or refused by an error that names it."""

import json
import math
import typing
from pathlib import Path

import numpy as np
import pytest
import toy_reach  # noqa: F401 - registers the example task
from hypothesis import given
from hypothesis import strategies as st

from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.envs.tasks.registry import TASKS, env_types
from lerobot_excav.errors import ConfigurationError
from lerobot_excav.setting import declared_settings

TASK_FIELDS = [(spec.id, name) for spec in TASKS.values() for name in declared_settings(spec.settings)]
PLAYED_FIELDS = [(t, name) for t in env_types() for name in declared_settings(DemonstrationSettings)]

numbers = st.one_of(
    st.sampled_from([0, -1, 2**31 - 1, 2**31, 2**63, 10**40, -(10**400), 0.0, -0.0, 1e300, 5.0, math.nan, math.inf]),
    st.integers(),
    st.floats(),
    st.sampled_from([np.float32(3), np.nan, np.array([1, 2]), np.array(3)]),
)
things = st.sampled_from(
    [None, True, False, "", "typo", "null", "5", [], [5], (), {}, {"a": 1}, b"x", object, Path("x")]
)
bad_values = st.one_of(numbers, things, st.text(max_size=5))


def is_declared(value, cls, name):
    """Tell whether a value is of the type and in the range that a field declares, in the plainest way."""
    allowed = declared_settings(cls)[name]
    types = typing.get_type_hints(cls)[name]
    types = typing.get_args(types) or (types,)
    types = (*types, int) if float in types else types
    if value is None or type(value) not in types:
        return value is None and type(None) in types
    if allowed.values is not None:
        return value in allowed.values
    if allowed.low is not None and not value >= allowed.low:
        return False
    return allowed.high is None or value <= allowed.high


def outcome(make, name):
    """Return what is made, or None if it is refused by an error that names the field."""
    try:
        return make()
    except ConfigurationError as error:
        return None if name in str(error) else error


@pytest.mark.parametrize(("task_id", "name"), TASK_FIELDS)
@given(value=bad_values)
def test_a_setting_of_a_task_is_declared_or_refused_by_its_name(task_id, name, value):
    spec = TASKS[task_id]
    # Whether there is such a task is asked by the environment only.
    env = outcome(lambda: spec.make_env(obs_type="agent_pos", **spec.make_settings(**{name: value}).as_dict()), name)
    if env is not None:
        assert is_declared(value, spec.settings, name)
        json.dumps(env.settings.as_dict())


@pytest.mark.slow
@pytest.mark.parametrize(("env_type", "name"), PLAYED_FIELDS)
@given(value=bad_values)
def test_a_setting_of_demonstrations_is_declared_or_refused_by_its_name(env_type, name, value):
    settings = outcome(lambda: DemonstrationSettings.of(env_type, **{"scenes": 2, name: value}), name)
    if settings is not None:
        assert is_declared(value, DemonstrationSettings, name)
        assert len(settings.pairs()) == settings.scenes * settings.targets
        json.dumps(settings.as_record())


@given(name=st.text(min_size=1, max_size=8), value=bad_values)
def test_an_unknown_name_is_refused_by_its_name(name, value):
    for env_type, spec in env_types().items():
        if name not in declared_settings(spec.settings):
            with pytest.raises(ConfigurationError, match="is not a setting of"):
                spec.make_settings(**{name: value})
        if name not in {"env", *declared_settings(DemonstrationSettings)}:
            with pytest.raises(ConfigurationError, match="is not known; allowed: '--first_scene'"):
                DemonstrationSettings.of(env_type, **{name: value})
