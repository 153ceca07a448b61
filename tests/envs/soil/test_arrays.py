import numpy as np

from lerobot_excav.envs.soil.arrays import vector_product


def test_the_vector_product_has_the_bits_of_numpy():
    for a, b in np.random.default_rng(0).normal(size=(100, 2, 3)):
        np.testing.assert_array_equal(vector_product(a, b), np.cross(a, b))
