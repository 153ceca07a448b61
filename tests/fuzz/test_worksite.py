"""Random joystick commands to machine and soil; after every tick nothing impossible may have happened.

Hypothesis shrinks what goes wrong and prints the steps that lead there. `make fuzz` plays many more steps.
"""

from operator import attrgetter

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, rule

from bench.soil import BUCKET, cone
from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.machines.excavator.layout import DIG_AREA_EXTENT_M, TARGET_BOX
from lerobot_excav.envs.machines.excavator.machine import ExcavatorMachine
from lerobot_excav.envs.soil import FIDELITIES, PRESETS, Reaction, Soil
from lerobot_excav.envs.soil.bucket import heaped_volume_m3

pytestmark = pytest.mark.slow

LEDGER_TOLERANCE_KG = 1e-6
FARTHEST_M = 20.0
"""Nothing is farther from the origin: the machine reaches 9 m, and soil falls down (guess)."""

FASTEST_M_S = 30.0
"""No parcel is faster: the bucket's tip moves at 10 m/s at most, and a fall from 5 m adds as much (guess)."""

FULLEST = 2.0
"""No load is larger, in heaped buckets: parcels may lie on top and on the rim (guess)."""

OVER_PILE, OVER_BOX = (0.0, 0.7, -1.0, -0.8), (1.4, 0.7, -1.0, -2.2)
"""Joint positions [rad]; the second carries a load."""

ticks = st.integers(1, 40)
sticks = st.tuples(*[st.floats(-1.0, 1.0)] * 4)
seeds = st.integers(0, 2**32 - 1)


def soil_problems(soil, mass_kg):
    """Return what is wrong with a soil, by name; its mass must be the given one [kg]."""
    ledger, positions, velocities = soil.ledger_kg(), soil.parcel_positions_w, soil.parcel_velocities_w
    most_kg = FULLEST * heaped_volume_m3(BUCKET, soil.parameters.slope_tan) * soil.density_kg_m3
    most_awake = soil.fidelity.most_awake + int(soil.parcel_is_load.sum())  # a load that wakes comes on top
    load_kg = float(soil.parcel_masses_kg[soil.parcel_is_load].sum())
    # A comparison with a number that is none is false, so it counts as wrong.
    holds = {
        "the ledger keeps its sum": abs(sum(ledger.values()) - mass_kg) <= LEDGER_TOLERANCE_KG,
        "no mass is negative": all(mass >= 0.0 for mass in ledger.values()),
        "the bucket is not fuller than full": max(ledger["bucket"], load_kg) <= most_kg,
        "the dig area is not below its floor": (soil.heights_m >= 0.0).all(),
        "the box is not below its floor": (soil.container_heights_m >= 0.0).all(),
        "parcels awake are within their bound": soil.awake_parcel_count <= most_awake,
        "parcels are on the worksite": (np.abs(positions) <= FARTHEST_M).all(),
        "parcels are not too fast": (np.abs(velocities) <= FASTEST_M_S).all(),
        "parcels have a mass": (soil.parcel_masses_kg > 0.0).all(),
    }
    return [name for name, is_true in holds.items() if not is_true]


def reaction_problems(reaction):
    """Return what is not finite in an answer of the soil, by name."""
    names = (
        *("force_w_n", "torque_w_nm", "payload_mass_kg", "payload_com_t"),
        *("impulse_w_ns", "angular_impulse_w_nms"),
    )
    values = {name: getattr(reaction, name) for name in names}
    values |= {name: getattr(reaction.patches, name) for name in ("points_w", "normals_w", "limits_n")}
    return [name for name, value in values.items() if not np.isfinite(value).all()]


class WorksiteMachine(RuleBasedStateMachine):
    """An excavator in front of a pile, from one command to the next."""

    @initialize(
        preset=st.sampled_from(sorted(PRESETS)),
        fidelity=st.sampled_from(sorted(FIDELITIES)),
        height_m=st.floats(0.3, 1.6),
        slope=st.floats(0.2, 1.2),
        swing_rad=st.floats(-1.5, 1.5),
    )
    def begin(self, preset, fidelity, height_m, slope, swing_rad):
        self.machine = ExcavatorMachine(container=TARGET_BOX)
        self.soil = Soil(preset, DIG_AREA_EXTENT_M, 0.05, fidelity, container=TARGET_BOX)
        self.heights_m = cone(self.soil, height_m, slope)
        self.joint_pos = np.array([swing_rad, *OVER_PILE[1:]])
        self.start_again()

    @rule()
    def start_again(self):
        self.machine.reset(self.joint_pos)
        self.soil.reset(self.heights_m)
        assert self.soil.heights_m.tobytes() == self.heights_m.tobytes()
        ledger = self.soil.ledger_kg()
        self.mass_kg = ledger.pop("grid")
        assert not any(ledger.values()), f"a reset left soil behind: {ledger}"

    @rule(command=sticks, ticks=ticks)
    def hold(self, command, ticks):
        self.play([command] * ticks)

    @rule(signs=st.tuples(*[st.sampled_from([-1.0, 1.0])] * 4), ticks=ticks)
    def push_every_stick_to_its_end(self, signs, ticks):
        self.play([signs] * ticks)

    @rule(seed=seeds, ticks=ticks, size=st.sampled_from([0.05, 1.0]))
    def tremble(self, seed, ticks, size):
        """Small commands show creep and chatter of a bucket in the ground."""
        self.play(np.random.default_rng(seed).uniform(-size, size, (ticks, 4)))

    @rule(command=sticks, ticks=ticks)
    def press_into_the_ground(self, command, ticks):
        self.play([(0.1 * command[0], -1.0, *command[2:])] * ticks)

    @rule(seed=seeds, disturbance=st.sampled_from([0.0, 0.3]))
    def scoop(self, seed, disturbance):
        """Dig, lift and swing to the box, which fills the bucket as an operator does."""
        self.go_to(OVER_PILE)
        strokes = [(0.0, -0.7, -0.2, 0.0)] * 60 + [(0.0, 0.0, -0.8, -0.4)] * 60 + [(0.0, 0.3, 0.0, -1.0)] * 50
        self.play(np.random.default_rng(seed).normal(strokes, disturbance))
        self.go_to(OVER_BOX)

    @rule(speed=st.floats(0.2, 1.0))
    def dump(self, speed):
        self.play([(0.0, 0.0, 0.0, speed)] * 70)

    def go_to(self, joint_pos):
        """Drive towards joint positions for 5 s at most."""
        for _ in range(250):
            way = np.array(joint_pos) - self.machine.joint_pos
            if np.abs(way).max() < 0.05:
                break
            self.play([np.sign(way) * np.sqrt(np.abs(way))])  # no faster than the swing can brake

    def play(self, commands):
        """Step machine and soil and check both after every tick."""
        for command in commands:
            reaction = self.soil.step(TICK_S, self.machine.tool())
            self.machine.tick(np.clip(command, -1.0, 1.0), reaction)
            problems = soil_problems(self.soil, self.mass_kg) + reaction_problems(reaction)
            assert not problems, f"{problems}: {self.soil.ledger_kg()}"
            assert np.isfinite([*self.machine.joint_pos, *self.machine.joint_vel]).all()


IS_LONG = settings.get_current_profile_name() == "fuzz"
SHORT = settings(max_examples=6, stateful_step_count=5, derandomize=True, deadline=None)
TestWorksite = WorksiteMachine.TestCase
TestWorksite.settings = settings() if IS_LONG else SHORT


def test_a_soil_that_loses_a_gram_is_found(monkeypatch):
    def leak(soil, dt_s, tool, step=Soil.step):
        soil._out_of_bounds_kg += 1e-3
        return step(soil, dt_s, tool)

    monkeypatch.setattr(Soil, "step", leak)
    worksite = WorksiteMachine()
    worksite.begin("sand", "fast", 1.0, 0.7, 0.0)
    with pytest.raises(AssertionError, match="the ledger keeps its sum"):
        worksite.hold((0.0, 0.0, 0.0, 0.0), 1)


@pytest.mark.parametrize(
    ("path", "index", "value", "named"),
    [
        ("_field.heights", (1, 1), -1e-12, "the dig area is not below its floor"),
        ("_field.heights", (1, 1), np.nan, "the ledger keeps its sum"),
        ("_box_field.heights", (1, 1), -0.1, "the box is not below its floor"),
        ("_loose.population.state.positions", (0, 2), -50.0, "parcels are on the worksite"),
        ("_loose.population.state.positions", (0, 2), np.nan, "parcels are on the worksite"),
        ("_loose.population.state.velocities", (1, 0), 100.0, "parcels are not too fast"),
        ("_loose.population.state.masses", 0, 0.0, "parcels have a mass"),
        ("_loose.population.state.masses", 0, -1.0, "no mass is negative"),
        ("_loose.population.state.masses", 1, 1e4, "the bucket is not fuller than full"),
    ],
)
def test_what_must_not_be_is_named(path, index, value, named):
    soil = Soil(container=TARGET_BOX)
    soil.add_parcels([[0.0, 0.0, 1.0], [0.0, 0.5, 1.0]], np.zeros((2, 3)))
    soil._loose.population.state.load[1] = 1
    mass_kg = sum(soil.ledger_kg().values())
    assert not soil_problems(soil, mass_kg)
    attrgetter(path)(soil)[index] = value
    assert named in soil_problems(soil, mass_kg)


def test_an_answer_that_is_not_finite_is_named():
    assert reaction_problems(Reaction.free(0.0, np.array([0.0, np.inf, 0.0]))) == ["payload_com_t"]
