"""The kernel for many worlds against the one that the soil uses."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lerobot_excav.envs.constants import TICK_S
from lerobot_excav.envs.soil.flow import flow
from lerobot_excav.envs.soil.layer import Ground, Layer, Window
from lerobot_excav.envs.soil.momentum import accelerate

wp = pytest.importorskip("warp", reason="install the extra gpu")
from lerobot_excav.envs.soil.gpu import momentum as gpu  # noqa: E402 - after the check

SHAPE = (23, 17)


def ground_of(border_height):
    return Ground(slope_tan=math.tan(0.6), cohesion_m=0.0, swell=1.0, dx=0.05, dy=0.04, border_height=border_height)


def sliding(seed, ground, *, steps):
    """Return a rough heap that has slid for a while, a body over a corner of it."""
    rng = np.random.default_rng(seed)
    layer = Layer.empty(SHAPE)
    layer.heights[:] = rng.uniform(0.0, 0.6, SHAPE) ** 2
    layer.bed[:] = layer.heights * rng.uniform(0.3, 1.0, SHAPE)
    layer.firm[:] = layer.bed
    layer.active[:] = 1
    layer.ceiling[:6, :5] = rng.uniform(0.0, 0.4, (6, 5))
    for _ in range(steps):
        flow(layer, ground, TICK_S)
    layer.crept_s[:] = rng.uniform(0.0, 2.0, SHAPE) * (rng.uniform(size=SHAPE) < 0.3)
    layer.next_speeds[:] = 0.0
    return layer


def expected(layer, ground, dt):
    """Return the speeds [m/s] that the soil's own kernel gives."""
    ours = Layer(*(array.copy() for array in layer))
    accelerate(ours, ground, Window(0, SHAPE[0], 0, SHAPE[1]), dt)
    return ours.next_speeds


def computed(layers, ground, dts):
    """Return the speeds [m/s] of all worlds from the kernel for many."""
    given_arrays = [
        wp.array(np.stack([getattr(layer, name) for layer in layers]), dtype=wp.float64, device="cpu")
        for name in ("heights", "bed", "ceiling", "crept_s", "speeds", "flux")
    ]
    speeds = wp.zeros(given_arrays[4].shape, dtype=wp.float64, device="cpu")
    gpu.accelerate(*given_arrays, ground, wp.array(dts, dtype=wp.float64, device="cpu"), speeds)
    return speeds.numpy()


@settings(max_examples=40)
@given(
    seed=st.integers(0, 2**32 - 1),
    border=st.sampled_from([math.inf, 0.0, 0.2]),
    dts=st.lists(st.floats(1e-4, TICK_S), min_size=1, max_size=3),
    steps=st.integers(0, 6),
)
def test_every_face_of_every_world_gets_the_speed_that_the_soils_own_kernel_gives(seed, border, dts, steps):
    ground = ground_of(border)
    layers = [sliding(seed + number, ground, steps=steps) for number in range(len(dts))]
    wanted = np.stack([expected(layer, ground, dt) for layer, dt in zip(layers, dts, strict=True)])
    np.testing.assert_allclose(computed(layers, ground, dts), wanted, rtol=1e-9, atol=1e-12)


def test_the_cases_compared_hold_moving_and_resting_faces():
    ground = ground_of(0.2)
    layer = sliding(1, ground, steps=3)
    moves = expected(layer, ground, 0.01) != 0.0
    assert 0.1 < moves.mean() < 0.9


def test_worlds_do_not_see_each_other():
    ground = ground_of(math.inf)
    layers = [sliding(number, ground, steps=2) for number in range(3)]
    together = computed(layers, ground, [0.01] * 3)
    alone = [computed([layer], ground, [0.01])[0] for layer in layers]
    assert np.array_equal(together, np.stack(alone))
