"""Random values in random fields of all configurations, and of several at once."""

import copy
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ..contract.field_rules import CONFIGURATIONS, POOL, Rule, problem, whole
from .mutation import inputs

WITH_FIELDS = sorted(name for name, (_, table, _) in CONFIGURATIONS.items() if table)  # warmup has none of its own

leaves = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**20), 10**20),
    st.integers(-2, 1025),
    st.floats(),
    st.text(max_size=12),
    st.binary(max_size=3),
)
values = st.recursive(
    leaves, lambda part: st.one_of(st.lists(part, max_size=3), st.dictionaries(st.text(max_size=5), part, max_size=3))
)


@st.composite
def fields(draw):
    """Draw a configuration, one of its fields, and a value: any, one near the field's limits, or one of the pool."""
    name = draw(st.sampled_from(WITH_FIELDS))
    field = draw(st.sampled_from(sorted(CONFIGURATIONS[name][1])))
    pools = [values, st.sampled_from(list(POOL.values()))]
    if examples := CONFIGURATIONS[name][1][field].examples:
        pools.append(st.sampled_from(list(examples)))
    return name, field, draw(st.one_of(pools))


def wrong(name, field, value):
    """Return what is wrong with how a configuration took a value, if something is."""
    kind, table, base = CONFIGURATIONS[name]
    rule = table[field]
    needs = {key: need for key, need in {**base, **rule.needs}.items() if key != field}
    return problem(lambda: kind(**needs, **{field: value}), is_harmless=bool(rule.allows(value)), name=field)


@inputs(few=200)
@given(chosen=fields())
def test_a_field_takes_what_its_page_allows_and_nothing_else(chosen):
    assert wrong(*chosen) is None


@inputs(few=50)
@given(data=st.data())
def test_a_configuration_with_one_harmful_field_among_harmless_ones_is_refused(data):
    name = data.draw(st.sampled_from(WITH_FIELDS))
    kind, table, base = CONFIGURATIONS[name]
    field = data.draw(st.sampled_from(sorted(table)))
    value = data.draw(values.filter(lambda value: not table[field].allows(value)))
    others = data.draw(st.lists(st.sampled_from(sorted(table)), max_size=2, unique=True))
    given_too = {
        other: copy.copy(next((v for v in table[other].examples if table[other].allows(v)), None))
        for other in others
        if other != field and any(table[other].allows(v) for v in table[other].examples)
    }
    # Two fields may also contradict each other, so any of them may be named.
    assert problem(lambda: kind(**{**base, **given_too, field: value}), is_harmless=False, name="") is None


def test_a_field_that_takes_everything_is_found_out(monkeypatch):
    monkeypatch.setitem(CONFIGURATIONS, "faulty", (lambda size: None, {"size": whole(1, 9)}, {}))
    assert wrong("faulty", "size", math.nan) == "accepted though harmful"


def test_a_rule_that_is_wrong_is_found_out(monkeypatch):
    kind, _, base = CONFIGURATIONS["excavator_operator"]
    monkeypatch.setitem(CONFIGURATIONS, "faulty", (kind, {"seed": Rule(lambda value: True)}, base))
    with pytest.raises(AssertionError):
        assert wrong("faulty", "seed", -1) is None
