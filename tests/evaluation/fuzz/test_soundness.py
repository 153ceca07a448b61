from types import SimpleNamespace

import numpy as np
import pytest

from lerobot_excav.envs.soil import FIDELITIES, Reaction
from lerobot_excav.evaluation.fuzz.soundness import LEDGER_TOLERANCE_KG, SoundnessCheck, reset_problem

HEIGHTS = np.ones((3, 3))


def sound_soil():
    """A soil in order, whose parts the tests spoil."""
    soil = SimpleNamespace(
        masses={"grid": 100.0, "bucket": 0.0, "parcels": 2.0, "box": 0.0, "out_of_bounds": 0.0},
        heights_m=HEIGHTS.copy(),
        container_heights_m=HEIGHTS.copy(),
        fidelity=FIDELITIES["standard"],
        awake_parcel_count=2,
        parcel_is_load=np.zeros(2, dtype=bool),
        parcel_positions_w=np.zeros((2, 3)),
        parcel_velocities_w=np.zeros((2, 3)),
        parcel_masses_kg=np.ones(2),
        payload_mass_kg=0.0,
        box_mass_kg=0.0,
    )
    soil.ledger_kg = lambda: soil.masses
    return soil


@pytest.fixture
def env():
    reaction = Reaction.free(0.0, np.zeros(3))
    return SimpleNamespace(
        worksite=SimpleNamespace(soil=sound_soil(), reaction=reaction),
        scene=SimpleNamespace(heights_m=HEIGHTS),
    )


def problem(env, spoil, observation=(0.0,)):
    check = SoundnessCheck(env)
    spoil(env.worksite.soil)
    return check.problem(np.array(observation))


def test_a_sound_state_is_not_complained_about(env):
    assert problem(env, lambda soil: None) == ""


def test_rounding_is_no_loss(env):
    assert problem(env, lambda soil: soil.masses.update(grid=100.0 + 0.5 * LEDGER_TOLERANCE_KG)) == ""


@pytest.mark.parametrize(
    ("spoil", "named"),
    [
        (lambda s: s.masses.update(grid=99.99), "ledger is off by -0.01"),
        (lambda s: s.masses.update(grid=np.nan), "ledger is off by nan"),
        (lambda s: s.masses.update(grid=102.5, bucket=-2.5), "negative mass"),
        (lambda s: s.heights_m.__setitem__((1, 1), -1e-12), "height of the dig area"),
        (lambda s: s.heights_m.__setitem__((1, 1), np.nan), "height of the dig area"),
        (lambda s: s.container_heights_m.__setitem__((1, 1), -0.1), "height of the box"),
        (lambda s: setattr(s, "awake_parcel_count", 10**6), "1000000 parcels are awake"),
        (lambda s: s.parcel_positions_w.__setitem__((0, 2), -50.0), "not on the worksite"),
        (lambda s: s.parcel_positions_w.__setitem__((0, 2), np.nan), "not on the worksite"),
        (lambda s: s.parcel_velocities_w.__setitem__((1, 0), 100.0), "too fast"),
        (lambda s: s.parcel_masses_kg.__setitem__(0, 0.0), "no mass"),
    ],
)
def test_what_must_not_be_is_named(env, spoil, named):
    assert named in problem(env, spoil)


def test_an_observation_that_is_no_number_is_named(env):
    assert "agent_pos" in problem(env, lambda soil: None, [0.0, np.nan])


def test_a_reaction_that_is_no_number_is_named(env):
    env.worksite.reaction = Reaction.free(0.0, np.array([0.0, np.inf, 0.0]))
    assert "reaction" in problem(env, lambda soil: None)


def test_a_reset_has_to_restore_the_scene(env):
    env.worksite.soil.parcel_positions_w = np.zeros((0, 3))
    assert reset_problem(env) == ""
    env.worksite.soil.heights_m[0, 0] += 1e-15
    assert "not that of the scene" in reset_problem(env)


def test_a_reset_has_to_remove_the_rest(env):
    assert "left soil behind" in reset_problem(env)
